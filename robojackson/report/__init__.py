"""Reports for people: the side-by-side video, the plots and the page."""
