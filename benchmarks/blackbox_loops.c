/* The loops of a recurrent network in plain C, as the limit for those of identification.blackbox.loops.
   gcc -O3 -march=native -ffast-math vectorises over the nodes; H is known when it is compiled. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#ifndef H
#define H 16
#endif

static inline double tanh_of(double z) {
    double t = 2.0 * z;
    t = t < 40.0 ? t : 40.0;
    t = t > -40.0 ? t : -40.0;
    double k = __builtin_rint(t * 1.4426950408889634);
    double r = t - k * 0.6931471805599453;
    double p = 1.0 / 39916800;
    static const double c[] = {1.0 / 3628800, 1.0 / 362880, 1.0 / 40320, 1.0 / 5040, 1.0 / 720, 1.0 / 120,
                               1.0 / 24, 1.0 / 6, 0.5, 1.0, 1.0};
    for (int i = 0; i < 11; i++) p = p * r + c[i];
    int64_t bits = ((int64_t)k + 1023) << 52;
    double two_k;
    memcpy(&two_k, &bits, 8);
    return 1.0 - 2.0 / (p * two_k + 1.0);
}

void simulate(long n, long m, long fed, const double *restrict w, const double *restrict u, double *restrict y) {
    long r = fed + m;
    const double *out = w + (r + 1) * H, *line = out + H;
    for (long t = fed; t < n; t++) {
        double z[H], s = line[r];
        for (int j = 0; j < H; j++) z[j] = w[r * H + j];
        for (long i = 0; i < m; i++) {
            double q = u[t * m + i];
            s += line[fed + i] * q;
            for (int j = 0; j < H; j++) z[j] += w[(fed + i) * H + j] * q;
        }
        for (long i = fed - 1; i >= 0; i--) {
            double q = y[t - 1 - i];
            s += line[i] * q;
            for (int j = 0; j < H; j++) z[j] += w[i * H + j] * q;
        }
        for (int j = 0; j < H; j++) s += out[j] * tanh_of(z[j]);
        y[t] = s;
    }
}

/* rows: (n, p), of which the first fed rows are given. */
void gradient(long n, long m, long fed, const double *restrict w, const double *restrict u, const double *restrict y,
              double *restrict rows) {
    long r = fed + m, p = (r + 1) * H + H + r + 1;
    const double *out = w + (r + 1) * H, *line = out + H;
    for (long t = fed; t < n; t++) {
        double *restrict row = rows + t * p;
        double z[H], g[H], phi[64];
        for (int j = 0; j < H; j++) z[j] = w[r * H + j];
        for (long i = 0; i < r; i++) {
            phi[i] = i < fed ? y[t - 1 - i] : u[t * m + i - fed];
            for (int j = 0; j < H; j++) z[j] += w[i * H + j] * phi[i];
        }
        for (int j = 0; j < H; j++) {
            double q = tanh_of(z[j]);
            row[(r + 1) * H + j] = q;
            g[j] = out[j] * (1.0 - q * q);
            row[r * H + j] = g[j];
        }
        for (long i = 0; i < r; i++)
            for (int j = 0; j < H; j++) row[i * H + j] = g[j] * phi[i];
        for (long i = 0; i < r; i++) row[(r + 2) * H + i] = phi[i];
        row[(r + 2) * H + r] = 1.0;
        for (long i = 0; i < fed; i++) {
            double gain = line[i];
            for (int j = 0; j < H; j++) gain += g[j] * w[i * H + j];
            const double *restrict before = rows + (t - 1 - i) * p;
            for (long k = 0; k < p; k++) row[k] += gain * before[k];
        }
    }
}
