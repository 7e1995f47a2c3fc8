"""What a person reads: pages made from run folders alone."""

from xgv_cosim.reports.report import write_report

__all__ = ["write_report"]
