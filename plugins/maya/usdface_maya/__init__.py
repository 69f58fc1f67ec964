"""usdface in Maya's USD export. Read against maya-usd's sources and tests, not run in Maya.

`shot` has the work, on any stage; `chaser` hands Maya's stage and options to it.
"""
