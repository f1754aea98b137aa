"""A study while it runs: its plan, its progress table, its runs on workers."""
