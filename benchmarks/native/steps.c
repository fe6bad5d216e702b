/* An embedded Runge-Kutta pair with chosen steps on y' = f(t, y) of a driveline with clearances, written out in C99:
   the yardstick of the compiled kernels. Same equation, tableau and error test; no samples, no crossings. */
#include <math.h>
#include <string.h>

typedef struct {
    long n, m, r, h, refs, size;              /* inertias, elements, basis, harmonics, references, states */
    const double *inertia, *drag, *rows, *basis, *combination;
    const long *references, *first_piece;
    const double *upper, *stiffness, *damping, *offset, *mean;
    const double *torque_sine, *torque_cosine, *error_sine, *error_cosine, *cycles;
    double period;
} field;

static void derivative(const field *p, double t, const double *y, double *wave, double *force, double *out) {
    const long n = p->n, m = p->m, r = p->r, h = p->h;
    const double turns = t / p->period;
    for (long j = 0; j < h; j++) {
        const double turn = p->cycles[j] * turns, angle = 2.0 * M_PI * (turn - floor(turn));
        wave[j] = sin(angle);
        wave[h + j] = cos(angle);
    }
    for (long k = 0; k < m; k++) {
        double d = 0.0, v = 0.0;
        for (long i = 0; i < r; i++) d += p->combination[k * r + i] * y[i];
        for (long i = 0; i < n; i++) v += p->rows[k * n + i] * y[r + i];
        for (long j = 0; j < h; j++) {
            const double omega = 2.0 * M_PI * p->cycles[j] / p->period;
            const double es = p->error_sine[k * h + j], ec = p->error_cosine[k * h + j];
            d -= es * wave[j] + ec * wave[h + j];
            v -= omega * (es * wave[h + j] - ec * wave[j]);
        }
        long q = p->first_piece[k];
        while (d > p->upper[q]) q++;
        force[k] = p->stiffness[q] * d + p->damping[q] * v + p->offset[q];
    }
    for (long i = 0; i < r; i++) {
        double total = 0.0;
        for (long j = 0; j < n; j++) total += p->basis[i * n + j] * y[r + j];
        out[i] = total;
    }
    for (long i = 0; i < n; i++) {
        double total = p->mean[i] - p->drag[i] * y[r + i];
        for (long j = 0; j < h; j++)
            total += p->torque_sine[i * h + j] * wave[j] + p->torque_cosine[i * h + j] * wave[h + j];
        for (long k = 0; k < m; k++) total -= p->rows[k * n + i] * force[k];
        out[r + i] = total / p->inertia[i];
    }
    for (long i = 0; i < p->refs; i++) out[r + n + i] = y[r + p->references[i]];
    for (long k = 0; k < m; k++) out[r + n + p->refs + k] = force[k];
}

/* March from 0 to end; counts[0] steps taken, counts[1] rejected. */
void march(const field *p, long stages, const double *a, const double *b, const double *c, const double *e, long order,
           const double *scale, double tolerance, double first, double end, double *y, long *counts) {
    const long s = p->size, active = p->r + p->n;
    double k[16][64], trial[64], after[64], wave[256], force[64], t = 0.0, h = first;
    derivative(p, t, y, wave, force, k[0]);
    while (t < end) {
        if (h > end - t) h = end - t;
        for (long i = 1; i < stages; i++) {
            for (long l = 0; l < s; l++) {
                double total = 0.0;
                for (long j = 0; j < i; j++) total += a[i * stages + j] * k[j][l];
                trial[l] = y[l] + h * total;
            }
            derivative(p, t + c[i] * h, trial, wave, force, k[i]);
        }
        double worst = 0.0;
        for (long l = 0; l < s; l++) {
            double total = 0.0, error = 0.0;
            for (long i = 0; i < stages; i++) {
                total += b[i] * k[i][l];
                error += e[i] * k[i][l];
            }
            after[l] = y[l] + h * total;
            if (l < active) worst = fmax(worst, fabs(h * error) / fmax(scale[l], fmax(fabs(y[l]), fabs(after[l]))));
        }
        const double err = worst / tolerance;
        const double factor = 0.9 * pow(fmax(err, 1e-10), -1.0 / (double)order);
        const double next = h * fmin(fmax(factor, 0.2), err <= 1.0 ? 5.0 : 1.0);
        if (err > 1.0) {
            counts[1]++;
        } else {
            t += h;
            memcpy(y, after, (size_t)s * sizeof(double));
            derivative(p, t, y, wave, force, k[0]);
            counts[0]++;
        }
        h = next;
    }
}
