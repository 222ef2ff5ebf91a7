"""What people look at: timelines and progress."""
