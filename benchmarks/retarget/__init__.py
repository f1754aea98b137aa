"""Our retargeting beside its peers."""
