"""One tab with the painter of the page, for all of its tests."""

import pytest

from tests.chromium import Watch


@pytest.fixture(scope="session")
def studio(browser):
    """One tab with the painter of the page, for all tests of it: `tests/page/studio.py`."""
    from tests.page.studio import Studio

    page = browser.new_page()
    watch = Watch(page)
    yield Studio(page)
    page.close()
    assert watch.complaints == []
