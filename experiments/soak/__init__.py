"""Long random trials of the project's promises: worlds, kills and damaged files.

energy, worlds; kills; damage -> command
"""
