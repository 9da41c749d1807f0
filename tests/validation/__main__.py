"""Write the page: ``python -m validation`` in the folder of the tests."""

from validation.table import PAGE, page

if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)
