/* Time loops that somebody would write in C for one damper model each: (n, dt, x, v, current, parameters, force). */
#include <math.h>

#define GAMMA 0.29289321881345247560
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

/* L-stable SDIRK2 (Alexander 1977) on the extension of the mount, Newton on the velocity of the core. */
#define STEPS(CORE, START, STAGE, CONTACT_F, CONTACT_W, LAST)                                       \
    double top = 0;                                                                                  \
    for (long i = 0; i < n; i++) top = fmax(top, fabs(v[i]));                                        \
    double ext = 0, w = v[0], gh = GAMMA * dt, tolerance = 1e-13 * top;                              \
    START                                                                                            \
    for (long i = 0; i + 1 < n; i++) {                                                               \
        double e0 = ext, e = 0, rate = 0;                                                            \
        for (int stage = 0; stage < 2; stage++) {                                                    \
            double xs, vs, q = stage ? 1.0 : GAMMA;                                                  \
            between(x, v, i, q, dt, &xs, &vs);                                                       \
            STAGE                                                                                    \
            double low = -INFINITY, high = INFINITY;                                                 \
            for (int k = 0; k < 80; k++) {                                                           \
                double f, f_w;                                                                       \
                rate = vs - w;                                                                       \
                e = e0 + gh * rate;                                                                  \
                CORE                                                                                 \
                double residual = f - (CONTACT_F), slope = f_w + (CONTACT_W);                        \
                double next = w - residual / slope;                                                  \
                int ready = fabs(next - w) <= 1e-7 * fabs(w) + tolerance;                            \
                if (residual < 0) low = w; else high = w;                                            \
                if (!ready && !(low < next && next < high)) next = 0.5 * (low + high);               \
                w = next;                                                                            \
                if (ready) break;                                                                    \
            }                                                                                        \
            rate = vs - w;                                                                           \
            e = e0 + gh * rate;                                                                      \
            if (!stage) e0 += (1 - GAMMA) * dt * rate;                                               \
            LAST                                                                                     \
        }                                                                                            \
        ext = e;                                                                                     \
        force[i + 1] = (CONTACT_F);                                                                  \
    }                                                                                                \
    force[0] = force[1];

#define ARCTAN double sw = S * w; f = F1 * TWO_OVER_PI * atan(sw) + d * w; \
    f_w = F1 * TWO_OVER_PI * S / (1 + sw * sw) + d;

void maxwell(long n, double dt, const double *x, const double *v, const double *u, const double *p, double *force)
{
    double F1 = p[0], S = p[1], d = p[2], K = p[3];
    STEPS(ARCTAN, , , K * e, gh * K, )
}

void enriched(long n, double dt, const double *x, const double *v, const double *u, const double *p, double *force)
{
    double F1 = p[0], S = p[1], d = p[2], K1 = p[3], K2 = p[4], C2 = p[5];
    double f2 = 0, f2_base = 0, scale = 1 / (1 + GAMMA * dt * K2 / C2);
    STEPS(ARCTAN, , if (!stage) f2_base = f2;, K1 * e + (f2_base + gh * K2 * rate) * scale, gh * K1 + gh * K2 * scale,
          double now = (f2_base + gh * K2 * rate) * scale;
          if (!stage) f2_base = f2 + (1 - GAMMA) / GAMMA * (now - f2); else f2 = now;)
}

void composed(long n, double dt, const double *x, const double *v, const double *current, const double *p, double *force)
{
    double soft = p[0], firm = p[1], u0 = p[2], u1 = p[3], knee = p[4], alpha = p[5], by_u = p[6], beta = p[7], delta = p[8];
    double tau = p[9], K = p[10], C = p[11], y = dt / tau, fade = exp(-y), ramp = 1 - (1 - fade) / y;
    double u = current[0], later = u;
    STEPS(double r = fmin(fmax((us - u0) / (u1 - u0), 0), 1); double c = soft + (firm - soft) * r;
          double ratio = w / knee; double root = 1 / sqrt(1 + ratio * ratio);
          double level = alpha + by_u * us; double th = tanh(beta * w + delta * sign(xs - e));
          f = c * w * root + level * th; f_w = c * root * root * root + level * beta * (1 - th * th);,
          , if (!stage) { u = later; later = fade * u + (1 - fade) * current[i] + ramp * (current[i + 1] - current[i]); }
          double us = u + q * (later - u);, K * e + C * rate, gh * K + C, )
}
