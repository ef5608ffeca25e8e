"""A portfolio: one request planned with several seeds at once, in processes of their own."""

from rbprm_core.portfolio.portfolio import plan_portfolio

__all__ = ["plan_portfolio"]
