"""usdface in usdview: a menu and a dock.

`container` is what usdview loads; `dock` and `curves` draw, `preview` shows results on the open
stage, `worker` computes in a process of its own, by the public functions of usdface.
"""
