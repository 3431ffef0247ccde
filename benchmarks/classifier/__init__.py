"""Where the classifier that is part of Tactful comes from and what it is worth."""
