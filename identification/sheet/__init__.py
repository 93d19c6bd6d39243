"""The characteristic sheet of a damper: figures and charts of its tests on one page."""

from identification.sheet.page import html_of, write_sheet
from identification.sheet.results import AtCurrent, Sheet, row, sheet_of, sheet_to_json

__all__ = ["AtCurrent", "Sheet", "html_of", "row", "sheet_of", "sheet_to_json", "write_sheet"]
