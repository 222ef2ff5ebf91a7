"""The report: one HTML page with its figures inside, and the numbers behind each as CSV. The only matplotlib."""

from tbatch.view.report.write import write_report

__all__ = ["write_report"]
