"""What is read, written and shown: files that are whole or not there, figures, the terminal."""
