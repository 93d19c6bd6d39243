"""The characteristic sheet of a damper: figures and charts of its tests on one page."""

from identification.sheet.page import html_of, write_sheet
from identification.sheet.results import Sheet, sheet_of, sheet_to_json

__all__ = ["Sheet", "html_of", "sheet_of", "sheet_to_json", "write_sheet"]
