"""The bench: methods and settings over a suite of cases.

The rows are kept one by one in one table.
"""
