/* A viscous damper as an FMU 2.0 for co-simulation: what another program would export.
   Inputs: x (mm, 0), v (m/s, 1), i (mA, 2). Parameters: c (3), c_i (4), lag (5, s), fails_at (6, s), how (7):
   0 error, 1 not a number, 2 crash, 3 never comes back. Output: force (kN, 8). */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
typedef void* Part;
typedef double Real;
typedef unsigned Ref;
enum { OK, WARNING, DISCARD, ERROR };
typedef struct { Real r[9]; } Damper;

const char* fmi2GetTypesPlatform(void) { return "default"; }
const char* fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(Part p, int on, size_t n, const char* const c[]) { return OK; }
Part fmi2Instantiate(const char* name, int type, const char* guid, const char* where, const void* f, int v, int l) {
  Damper* d = calloc(1, sizeof(Damper));
  d->r[3] = 650.0; d->r[6] = 1e300;
  return d;
}
void fmi2FreeInstance(Part p) { free(p); }
int fmi2SetupExperiment(Part p, int has, Real tol, Real start, int stops, Real stop) { return OK; }
int fmi2EnterInitializationMode(Part p) { return OK; }
static Real viscous(const Real* r) { return (r[3] + r[4] * r[2] / 1000.0) * r[1] / 1000.0; }
int fmi2ExitInitializationMode(Part p) {
  ((Damper*)p)->r[8] = viscous(((Damper*)p)->r);
  return OK;
}
int fmi2Terminate(Part p) { return OK; }
int fmi2Reset(Part p) { return OK; }
int fmi2GetReal(Part p, const Ref ref[], size_t n, Real out[]) {
  for (size_t k = 0; k < n; k++) out[k] = ((Damper*)p)->r[ref[k]];
  return OK;
}
int fmi2SetReal(Part p, const Ref ref[], size_t n, const Real in[]) {
  for (size_t k = 0; k < n; k++) ((Damper*)p)->r[ref[k]] = in[k];
  return OK;
}
int fmi2DoStep(Part p, Real t, Real h, int keep) {
  Real* r = ((Damper*)p)->r;
  if (t >= r[6]) {
    if (r[7] == 3.0) for (;;) sleep(1);
    if (r[7] == 2.0) abort();
    if (r[7] == 1.0) { r[8] = NAN; return OK; }
    fprintf(stderr, "the valve model has no solution\n");
    return ERROR;
  }
  r[8] = r[5] > 0.0 ? r[8] + (viscous(r) - r[8]) * (1.0 - exp(-h / r[5])) : viscous(r);
  return OK;
}
#define NOT(name) int name(void) { return ERROR; }
NOT(fmi2GetInteger) NOT(fmi2GetBoolean) NOT(fmi2GetString) NOT(fmi2SetInteger) NOT(fmi2SetBoolean) NOT(fmi2SetString)
int fmi2GetFMUstate(Part p, Part* state) {
  if (!*state) *state = malloc(sizeof(Damper));
  memcpy(*state, p, sizeof(Damper));
  return OK;
}
int fmi2SetFMUstate(Part p, Part state) { memcpy(p, state, sizeof(Damper)); return OK; }
int fmi2FreeFMUstate(Part p, Part* state) { free(*state); *state = NULL; return OK; }
NOT(fmi2SerializedFMUstateSize)
NOT(fmi2SerializeFMUstate) NOT(fmi2DeSerializeFMUstate) NOT(fmi2GetDirectionalDerivative)
NOT(fmi2SetRealInputDerivatives) NOT(fmi2GetRealOutputDerivatives) NOT(fmi2CancelStep) NOT(fmi2GetStatus)
NOT(fmi2GetRealStatus) NOT(fmi2GetIntegerStatus) NOT(fmi2GetBooleanStatus) NOT(fmi2GetStringStatus)
