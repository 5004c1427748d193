"""The studies: one script per question, a declared grid each.

`python -m experiments.ablations.effectiveness --out ROOT` is `hebbtorch campaign effectiveness
--out ROOT`.
"""
