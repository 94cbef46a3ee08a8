"""A log made ready: when it flies, how it moves, how hard it is flown.

`flight.ready` does it: a log that has the `fitness` goes on a regular `clock`; `missing` samples are filled, moments of
`contact` marked, `attitude` and `heights` worked out where the log has none. `blocks` are what spectra are taken of,
`filters` what SciPy would take a second to import for, `hardness` how hard a block is flown.
"""
