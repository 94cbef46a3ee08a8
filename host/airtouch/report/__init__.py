"""Pages, plots and tables: they render what the other packages have worked out.

gap_report, gap_tables, gap_figures     the page of `airtouch gap`: its frame, its tables, its plots
blind_tables, blind_figures             a sealed set: its figures beside their goals, and its plot
evaluation_report, evaluation_figures   the page on scored flights, and its plots
columns                                 the columns of score tables, which the terminal shows too
map_figure                              the plot of an edge map
twin_report, twin_figures               the page of `airtouch twin`, and its plots
html_page                               a page from its template
style                                   the look of every plot

A plot is a function that returns a matplotlib `Figure`. `html_page.embedded` makes of one what a page holds,
`style.write_image` a PNG, SVG or PDF file.
"""
