"""Events of a branch: where motions appear or vanish, gain or lose stability, or touch other corners.

Between two points of a branch a test function changes its sign (T_p: the tangent's part along the parameter, M: the
gradient of the period map):

    fold               T_p
    period doubling    det(I + M)
    symmetry breaking  det(I - M), where T_p keeps its sign: another branch crosses; of symmetric motions det(I + DH)
    Neimark-Sacker     modulus of the complex pair nearest to the unit circle, less 1; without damping pairs lie on the
                       circle all along, and leave it where two of them meet
    grazing            two crossings of one corner appear or vanish; they meet at velocity zero, so the square of
                       their velocity is a test function on the side where they exist
    pattern            the same crossings in another order; the time between two of them is the test function. A slider
                       that is released sooner than it slips has one crossing less: enclosed

Where a slider begins to slip the gradient jumps (``grazing``): then a determinant may change its sign without being
zero, and the motion folds or doubles its period in a corner of the branch (*border collision*). Patterns are compared
by the crossings of clearances first; where these are the same, by those of sliders and limiters as well.

Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, 4th ed., Springer 2023; M. di Bernardo, C. J. Budd, A. R.
Champneys, P. Kowalczyk, Piecewise-smooth Dynamical Systems, Springer 2008.
"""
