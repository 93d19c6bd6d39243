/* Time loops that somebody would write in C for one damper model each: (n, dt, x, v, current, parameters, force). */
#include <math.h>

#define TWO_OVER_PI 0.63661977236758134308

static inline double sign(double s) { return (s > 0) - (s < 0); }

/* Cubic between samples, as exact as the samples themselves. */
static inline void between(const double *x, const double *v, long i, double q, double dt, double *xs, double *vs)
{
    double q2 = q * q, q3 = q2 * q, dx = x[i + 1] - x[i];
    *xs = x[i] + (3 * q2 - 2 * q3) * dx + dt * ((q3 - 2 * q2 + q) * v[i] + (q3 - q2) * v[i + 1]);
    *vs = 6 * (q - q2) * dx / dt + (3 * q2 - 4 * q + 1) * v[i] + (3 * q2 - 2 * q) * v[i + 1];
}

static inline double wen_rate(double w, double h, double A, double n, double beta, double gamma)
{
    double m = pow(fabs(h), n - 1);
    return A * w - gamma * fabs(w) * h * m - beta * w * fabs(h) * m;
}

void bouc_wen(long n, double dt, const double *x, const double *v, const double *u, const double *p, double *force)
{
    double c = p[0], k = p[1], alpha = p[2], A = p[3], e = p[4], beta = p[5], gamma = p[6];
    double h = sign(v[0]) * pow(A / (beta + gamma), 1 / e), s = dt / 4, xs;
    force[0] = c * v[0] + k * x[0] + alpha * h;
    for (long i = 0; i + 1 < n; i++) {
        for (int sub = 0; sub < 4; sub++) {
            double a, b, d;
            between(x, v, i, sub / 4.0, dt, &xs, &a);
            between(x, v, i, (sub + 0.5) / 4, dt, &xs, &b);
            between(x, v, i, (sub + 1) / 4.0, dt, &xs, &d);
            double k1 = wen_rate(a, h, A, e, beta, gamma), k2 = wen_rate(b, h + s / 2 * k1, A, e, beta, gamma);
            double k3 = wen_rate(b, h + s / 2 * k2, A, e, beta, gamma), k4 = wen_rate(d, h + s * k3, A, e, beta, gamma);
            h += s / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        }
        force[i + 1] = c * v[i + 1] + k * x[i + 1] + alpha * h;
    }
}

void modified(long n, double dt, const double *x, const double *v, const double *u, const double *p, double *force)
{
    double c0 = p[0], k0 = p[1], alpha = p[2], A = p[3], e = p[4], beta = p[5], gamma = p[6], c1 = p[7], k1 = p[8];
    double h = sign(v[0]) * pow(A / (beta + gamma), 1 / e), y = 0, s = dt / 4;
    for (long i = 0; i < n; i++) {
        force[i] = c1 * (alpha * h + k0 * (x[i] - y) + c0 * v[i]) / (c0 + c1) + k1 * x[i];
        if (i + 1 == n) break;
        for (int sub = 0; sub < 4; sub++) {
            double dy[4], dh[4], at[4] = {sub / 4.0, (sub + 0.5) / 4, (sub + 0.5) / 4, (sub + 1) / 4.0};
            double part[4] = {0, 0.5, 0.5, 1};
            for (int j = 0; j < 4; j++) {
                double xs, vs, ys = y + (j ? part[j] * s * dy[j - 1] : 0), hs = h + (j ? part[j] * s * dh[j - 1] : 0);
                between(x, v, i, at[j], dt, &xs, &vs);
                dy[j] = (alpha * hs + k0 * (xs - ys) + c0 * vs) / (c0 + c1);
                dh[j] = wen_rate(vs - dy[j], hs, A, e, beta, gamma);
            }
            y += s / 6 * (dy[0] + 2 * dy[1] + 2 * dy[2] + dy[3]);
            h += s / 6 * (dh[0] + 2 * dh[1] + 2 * dh[2] + dh[3]);
        }
    }
}

#define ROOT6 2.44948974278317809820
static const double WEIGHTS[3][3] = {
    {(88 - 7 * ROOT6) / 360, (296 - 169 * ROOT6) / 1800, (-2 + 3 * ROOT6) / 225},
    {(296 + 169 * ROOT6) / 1800, (88 + 7 * ROOT6) / 360, (-2 - 3 * ROOT6) / 225},
    {(16 - ROOT6) / 36, (16 + ROOT6) / 36, 1.0 / 9}};
static const double NODES[3] = {(4 - ROOT6) / 10, (4 + ROOT6) / 10, 1};

/* Inverse of a 3 × 3 matrix. */
static inline void invert(const double m[3][3], double o[3][3])
{
    double p = m[1][1] * m[2][2] - m[1][2] * m[2][1], q = m[1][2] * m[2][0] - m[1][0] * m[2][2];
    double r = m[1][0] * m[2][1] - m[1][1] * m[2][0], s = 1 / (m[0][0] * p + m[0][1] * q + m[0][2] * r);
    o[0][0] = s * p; o[0][1] = s * (m[0][2] * m[2][1] - m[0][1] * m[2][2]); o[0][2] = s * (m[0][1] * m[1][2] - m[0][2] * m[1][1]);
    o[1][0] = s * q; o[1][1] = s * (m[0][0] * m[2][2] - m[0][2] * m[2][0]); o[1][2] = s * (m[0][2] * m[1][0] - m[0][0] * m[1][2]);
    o[2][0] = s * r; o[2][1] = s * (m[0][1] * m[2][0] - m[0][0] * m[2][1]); o[2][2] = s * (m[0][0] * m[1][1] - m[0][1] * m[1][0]);
}

/* The parabola through three values at the nodes of one step, at the nodes of the next. */
static void ahead(double o[3][3])
{
    double vander[3][3], inverse[3][3];
    for (int s = 0; s < 3; s++) { vander[s][0] = 1; vander[s][1] = NODES[s]; vander[s][2] = NODES[s] * NODES[s]; }
    invert(vander, inverse);
    for (int s = 0; s < 3; s++)
        for (int j = 0; j < 3; j++)
            o[s][j] = inverse[0][j] + (1 + NODES[s]) * inverse[1][j] + (1 + NODES[s]) * (1 + NODES[s]) * inverse[2][j];
}

/* Three-stage Radau IIA on the rates r of the mount's extension, Newton from the extrapolated rates of the last step.
   CORE computes f and f_w from w, xs − e and q; M[s][j] is the slope of the mount's force by the rates, BASE(s) its
   force at none. */
#define STEPS(START, CORE, BASE, END, FORCE)                                                         \
    double top = 0, next[3][3], shape[3][3], ext = 0, r[3] = {0, 0, 0}, hA[3][3], M[3][3];           \
    for (long i = 0; i < n; i++) top = fmax(top, fabs(v[i]));                                        \
    ahead(next);                                                                                     \
    for (int s = 0; s < 3; s++) {                                                                    \
        double q = NODES[s];                                                                         \
        shape[s][0] = 6 * q * (1 - q) / dt; shape[s][1] = (3 * q - 1) * (q - 1); shape[s][2] = q * (3 * q - 2); \
        for (int j = 0; j < 3; j++) hA[s][j] = dt * WEIGHTS[s][j];                                   \
    }                                                                                                \
    START                                                                                            \
    for (long i = 0; i + 1 < n; i++) {                                                               \
        double vs[3], old[3] = {r[0], r[1], r[2]}, d[3] = {0, 0, 0}, last = INFINITY;                \
        END                                                                                          \
        for (int s = 0; s < 3; s++) {                                                                \
            vs[s] = shape[s][0] * (x[i + 1] - x[i]) + shape[s][1] * v[i] + shape[s][2] * v[i + 1];   \
            r[s] = next[s][0] * old[0] + next[s][1] * old[1] + next[s][2] * old[2];                  \
        }                                                                                            \
        for (int k = 0; k < 30; k++) {                                                               \
            double g[3], J[3][3], I[3][3], size = 0;                                                 \
            for (int s = 0; s < 3; s++) {                                                            \
                double f, f_w, w = vs[s] - r[s];                                                     \
                CORE                                                                                 \
                g[s] = f - (BASE) - (M[s][0] * r[0] + M[s][1] * r[1] + M[s][2] * r[2]);              \
                for (int j = 0; j < 3; j++) J[s][j] = M[s][j];                                       \
                J[s][s] += f_w;                                                                      \
                size += fabs(g[s]);                                                                  \
            }                                                                                        \
            if (size > last) {                                                                       \
                for (int s = 0; s < 3; s++) { d[s] *= 0.5; r[s] -= d[s]; }                           \
                continue;                                                                            \
            }                                                                                        \
            last = size;                                                                             \
            invert(J, I);                                                                            \
            int ready = 1;                                                                           \
            for (int s = 0; s < 3; s++) {                                                            \
                d[s] = I[s][0] * g[0] + I[s][1] * g[1] + I[s][2] * g[2];                             \
                r[s] += d[s];                                                                        \
                ready &= fabs(d[s]) <= 1e-7 * fabs(vs[s] - r[s]) + 1e-13 * top;                      \
            }                                                                                        \
            if (ready) break;                                                                        \
        }                                                                                            \
        ext += hA[2][0] * r[0] + hA[2][1] * r[1] + hA[2][2] * r[2];                                  \
        force[i + 1] = FORCE;                                                                        \
    }                                                                                                \
    force[0] = force[1];

#define ARCTAN double sw = S * w; f = F1 * TWO_OVER_PI * atan(sw) + d_ * w; \
    f_w = F1 * TWO_OVER_PI * S / (1 + sw * sw) + d_;

void maxwell(long n, double dt, const double *x, const double *v, const double *u, const double *p, double *force)
{
    double F1 = p[0], S = p[1], d_ = p[2], K = p[3];
    STEPS(for (int s = 0; s < 3; s++) for (int j = 0; j < 3; j++) M[s][j] = K * hA[s][j];, ARCTAN, K * ext, , K * ext)
}

void enriched(long n, double dt, const double *x, const double *v, const double *u, const double *p, double *force)
{
    double F1 = p[0], S = p[1], d_ = p[2], K1 = p[3], K2 = p[4], C2 = p[5], f2 = 0, by_force[3], by_rate[3][3];
    STEPS(
        double lag[3][3]; double fade[3][3];
        for (int s = 0; s < 3; s++) for (int j = 0; j < 3; j++) lag[s][j] = K2 / C2 * hA[s][j] + (s == j);
        invert(lag, fade);
        for (int s = 0; s < 3; s++) {
            by_force[s] = fade[s][0] + fade[s][1] + fade[s][2];
            for (int j = 0; j < 3; j++) {
                by_rate[s][j] = K2 * (fade[s][0] * hA[0][j] + fade[s][1] * hA[1][j] + fade[s][2] * hA[2][j]);
                M[s][j] = K1 * hA[s][j] + by_rate[s][j];
            }
        },
        ARCTAN, K1 * ext + by_force[s] * f2, ,
        K1 * ext + (f2 = by_force[2] * f2 + by_rate[2][0] * r[0] + by_rate[2][1] * r[1] + by_rate[2][2] * r[2]))
}

void composed(long n, double dt, const double *x, const double *v, const double *current, const double *p, double *force)
{
    double soft = p[0], firm = p[1], u0 = p[2], u1 = p[3], knee = p[4], alpha = p[5], by_u = p[6], beta = p[7], delta = p[8];
    double tau = p[9], K = p[10], C = p[11], y = dt / tau, fade = exp(-y), ramp = 1 - (1 - fade) / y;
    double u = current[0], later = u, xs[3];
    STEPS(for (int s = 0; s < 3; s++) for (int j = 0; j < 3; j++) M[s][j] = K * hA[s][j] + (s == j) * C;,
          double us = u + NODES[s] * (later - u); double c = soft + (firm - soft) * fmin(fmax((us - u0) / (u1 - u0), 0), 1);
          double ratio = w / knee; double root = 1 / sqrt(1 + ratio * ratio); double level = alpha + by_u * us;
          double e = ext + hA[s][0] * r[0] + hA[s][1] * r[1] + hA[s][2] * r[2];
          double th = tanh(beta * w + delta * sign(xs[s] - e));
          f = c * w * root + level * th; f_w = c * root * root * root + level * beta * (1 - th * th);,
          K * ext,
          u = later; later = fade * u + (1 - fade) * current[i] + ramp * (current[i + 1] - current[i]);
          for (int s = 0; s < 3; s++) { double unused; between(x, v, i, NODES[s], dt, &xs[s], &unused); },
          K * ext + C * r[2])
}
