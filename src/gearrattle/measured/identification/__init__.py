"""Parameters of a driveline from measured or published modes and frequency responses.

A model names its parameters, data name what was seen; weighted least squares in the logarithms of the parameters, from
many starts, brings them together. As important as the values is what the data do not say: ``identifiability`` tells
which combinations of parameters may change without any datum noticing.
"""
