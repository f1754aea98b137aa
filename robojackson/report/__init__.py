"""What a person looks at: the side-by-side video, the plots and the page."""
