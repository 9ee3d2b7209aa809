"""`brushgs view`: the page of a painting, served to this machine's browser, with controls that need the
program.

From the inside out: `settings` parses requests of the page; `session` makes paintings, pictures and videos of
them, without threads and HTTP; `work` has worker threads; `hearing` collects their warnings; `studio` is the
state of the page; `server` is the HTTP front; `serve` is the command.
"""
