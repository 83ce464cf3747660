"""Statistical tests with p-values: see clrt.study.significance."""

from clrt.study.significance import chi2_test, mean_test, sidak

__all__ = ["chi2_test", "mean_test", "sidak"]
