"""`brushgs view`: the page of a painting, served to this machine's own browser, with what needs more than it.

From the inside out: `settings` reads what the page asks for; `session` makes a painting of it, pictures and
videos, without threads and HTTP; `work` has threads that do one thing at a time; `hearing` hears them;
`studio` is the state that the page shows; `server` puts HTTP before it; `serve` is the command.
"""
