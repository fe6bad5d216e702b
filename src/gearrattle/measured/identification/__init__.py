"""Parameters of a driveline from measured or published modes and frequency responses.

Parameters of the model are fitted to the data by weighted least squares in the logarithms of the parameters, from many
starts. As important as the values are the combinations of parameters that may change without any change of the data:
``identifiability`` finds them.
"""
