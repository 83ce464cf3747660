"""A scene that is looked at while it changes: all that an interactive window needs but the window."""
