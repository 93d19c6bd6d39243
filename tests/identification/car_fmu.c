/* A quarter car as an FMU 2.0 for co-simulation: what another program would export. Inputs: z_road (m, 0), v_road
   (m/s, 1), F (kN, 2), the damper's force. Outputs: s (mm, 3), s_dot (m/s, 4), a_body (m/s2, 5), body (m, 6).
   States: body, wheel, and their velocities. Parameter: m_body (7, kg). Input are linear over a step. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
typedef void* Part;
typedef double Real;
typedef unsigned Ref;
enum { OK, WARNING, DISCARD, ERROR };
typedef struct { Real r[8], q[4], was[3]; } Car;

static void rate(const Car* c, const Real* q, const Real* in, Real* out) {
  Real spring = 17e3 * (q[0] - q[1]) + 1000.0 * in[2];
  Real tyre = 180e3 * (q[1] - in[0]) + 100.0 * (q[3] - in[1]);
  out[0] = q[2]; out[1] = q[3]; out[2] = -spring / c->r[7]; out[3] = (spring - tyre) / 40.0;
}
static void read_out(Car* c) {
  Real d[4];
  rate(c, c->q, c->r, d);
  c->r[3] = 1000.0 * (c->q[0] - c->q[1]); c->r[4] = c->q[2] - c->q[3]; c->r[5] = d[2]; c->r[6] = c->q[0];
}
const char* fmi2GetTypesPlatform(void) { return "default"; }
const char* fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(Part p, int on, size_t n, const char* const c[]) { return OK; }
Part fmi2Instantiate(const char* name, int type, const char* guid, const char* where, const void* f, int v, int l) {
  Car* c = calloc(1, sizeof(Car));
  c->r[7] = 300.0;
  return c;
}
void fmi2FreeInstance(Part p) { free(p); }
int fmi2SetupExperiment(Part p, int has, Real tol, Real start, int stops, Real stop) { return OK; }
int fmi2EnterInitializationMode(Part p) { return OK; }
int fmi2ExitInitializationMode(Part p) {
  Car* c = p;
  memcpy(c->was, c->r, sizeof c->was);
  read_out(c);
  return OK;
}
int fmi2Terminate(Part p) { return OK; }
int fmi2Reset(Part p) { return OK; }
int fmi2GetReal(Part p, const Ref ref[], size_t n, Real out[]) {
  for (size_t k = 0; k < n; k++) out[k] = ((Car*)p)->r[ref[k]];
  return OK;
}
int fmi2SetReal(Part p, const Ref ref[], size_t n, const Real in[]) {
  for (size_t k = 0; k < n; k++) ((Car*)p)->r[ref[k]] = in[k];
  return OK;
}
int fmi2DoStep(Part p, Real t, Real h, int keep) {
  Car* c = p;
  Real k[4][4], q[4], in[3];
  const Real at[4] = {0.0, 0.5, 0.5, 1.0};
  for (int n = 0; n < 4; n++) {
    for (int j = 0; j < 3; j++) in[j] = c->was[j] + at[n] * (c->r[j] - c->was[j]);
    for (int j = 0; j < 4; j++) q[j] = c->q[j] + (n ? h * at[n] * k[n - 1][j] : 0.0);
    rate(c, q, in, k[n]);
  }
  for (int j = 0; j < 4; j++) c->q[j] += h / 6.0 * (k[0][j] + 2.0 * k[1][j] + 2.0 * k[2][j] + k[3][j]);
  memcpy(c->was, c->r, sizeof c->was);
  read_out(c);
  return OK;
}
int fmi2GetFMUstate(Part p, Part* state) {
  if (!*state) *state = malloc(sizeof(Car));
  memcpy(*state, p, sizeof(Car));
  return OK;
}
int fmi2SetFMUstate(Part p, Part state) { memcpy(p, state, sizeof(Car)); return OK; }
int fmi2FreeFMUstate(Part p, Part* state) { free(*state); *state = NULL; return OK; }
#define NOT(name) int name(void) { return ERROR; }
NOT(fmi2GetInteger) NOT(fmi2GetBoolean) NOT(fmi2GetString) NOT(fmi2SetInteger) NOT(fmi2SetBoolean) NOT(fmi2SetString)
NOT(fmi2SerializedFMUstateSize) NOT(fmi2SerializeFMUstate) NOT(fmi2DeSerializeFMUstate)
NOT(fmi2GetDirectionalDerivative) NOT(fmi2SetRealInputDerivatives) NOT(fmi2GetRealOutputDerivatives)
NOT(fmi2CancelStep) NOT(fmi2GetStatus) NOT(fmi2GetRealStatus) NOT(fmi2GetIntegerStatus) NOT(fmi2GetBooleanStatus)
NOT(fmi2GetStringStatus)
