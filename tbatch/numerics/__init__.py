"""How the equations are stepped: coefficients, factorisations and the one-run reference."""
