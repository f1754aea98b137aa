"""From a query to a ranked table of videos."""
