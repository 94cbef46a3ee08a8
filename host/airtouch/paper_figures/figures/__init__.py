"""The paper's figures and tables, one function each; `run.FIGURES` names them."""
