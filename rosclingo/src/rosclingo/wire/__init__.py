"""What clients and solver nodes say to each other: values, and their XML. Needs no clingo."""
