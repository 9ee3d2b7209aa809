"""One tab with the painter of the page, for all of its tests."""

import pytest

from tests.chromium import blank_tab
from tests.firefox import firefox  # noqa: F401


@pytest.fixture(scope="session")
def studio(browser):
    """`tests/page/studio.py`."""
    from tests.outlets.page.studio import Studio

    with blank_tab(browser) as page:
        yield Studio(page)
