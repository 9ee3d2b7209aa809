"""Programs that show and measure what brushgs does; no part of the package."""
