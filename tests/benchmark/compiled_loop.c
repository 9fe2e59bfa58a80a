/* The peer of calibrate_vs_compiled_loop: a motor with Coulomb friction by a classical Runge-Kutta, one step a sample, as a user
   would write it to call it from scipy. Friction is smoothed over 1 rad/s. */
#include <math.h>

static double slope(double omega, double e, const double* p) {
  return (p[1] * (e - p[1] * omega) / p[0] - p[2] * omega - p[4] * tanh(omega)) / p[3];
}

/* p: R_a, K, B, J, T_c; out: omega, then i_a */
void simulate(const double* e, long n, double h, double omega, const double* p, double* out) {
  for (long k = 0; k < n; ++k) {
    out[k] = omega;
    out[n + k] = (e[k] - p[1] * omega) / p[0];
    if (k + 1 == n) break;
    const double middle = 0.5 * (e[k] + e[k + 1]);
    const double a = slope(omega, e[k], p), b = slope(omega + 0.5 * h * a, middle, p);
    const double c = slope(omega + 0.5 * h * b, middle, p), d = slope(omega + h * c, e[k + 1], p);
    omega += h / 6 * (a + 2 * b + 2 * c + d);
  }
}
