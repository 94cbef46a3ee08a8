"""Pages, plots and tables: they render what the other packages have worked out.

gap_report, gap_tables, gap_figures   the page of `airtouch gap`: its frame, its tables, its plots
blind_figures                         the figures of a sealed set beside their goals, and its plot
evaluation_report                     the page on scored flights
figures                               plots of flights and scores
columns                               the columns of score tables, which the terminal shows too
map_figure                            the plot of an edge map
twin_report, twin_figures             the page of `airtouch twin`, and its plots
html_page                             a page from its template
style                                 the look of every plot
"""
