"""Pictures are read and written, videos written."""
