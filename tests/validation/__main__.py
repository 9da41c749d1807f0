"""Write the page and its table: ``python -m validation`` in the folder of the tests."""

from validation.table import ALL, PAGE, TABLE, page, table

if __name__ == "__main__":
    rows = {title: part.make() for title, part in ALL.items()}
    PAGE.write_text(page(rows), encoding="utf-8")
    TABLE.write_text(table(rows), encoding="utf-8")
    print(PAGE, TABLE, sep="\n")
