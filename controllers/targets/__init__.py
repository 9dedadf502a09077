"""What can be asked of the arm: a file a kind, with its checks and the task that it becomes."""
