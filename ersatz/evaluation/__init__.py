"""Agreement with experts (paper: Experimental Evaluation): scenarios, votes, rivals, figures, a report."""
