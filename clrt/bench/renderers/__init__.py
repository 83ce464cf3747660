"""Other renderers: scenes translated for them, and images compared with theirs."""
