"""Statistics, tables, figures and the verdicts on the paper's claims."""
