"""The studies: one script per question, a declared grid each.

`python -m experiments.studies.effectiveness --out ROOT` is `hebbtorch campaign effectiveness
--out ROOT`.
"""
