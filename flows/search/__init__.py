"""The search pipeline: from a query to a ranked table of videos."""
