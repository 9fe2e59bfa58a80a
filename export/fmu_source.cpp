#include "export/fmu_source.h"

namespace emtb {

const char* const fmu_source_head = R"(
#include "emtb_model.h"
#include <stdlib.h>
#include <string.h>

/* As the FMI standard 2.0 declares them. */
typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef struct {
  void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
  void *(*allocateMemory)(size_t, size_t);
  void (*freeMemory)(void *);
  void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
  fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;
#if defined _WIN32
#define FMI2 __declspec(dllexport)
#elif defined __GNUC__
#define FMI2 __attribute__((visibility("default")))
#else
#define FMI2
#endif

typedef struct {
  emtb_state s;
  emtb_parameters p;
  double u, load;
  int started;
  char *name;
  const fmi2CallbackFunctions *calls;
} component;

)";

const char* const fmu_source_functions = R"(
static const double longest = 1e-3; /* [s] of a step of the model */

static fmi2Status complain(component *c, const char *what) {
  if (c->calls && c->calls->logger)
    c->calls->logger(c->calls->componentEnvironment, c->name, fmi2Error, "logStatusError", "%s", what);
  return fmi2Error;
}

static void begin(component *c) {
  emtb_start(&c->s, &c->p, c->u);
  c->started = 1;
}

FMI2 const char *fmi2GetTypesPlatform(void) { return "default"; }
FMI2 const char *fmi2GetVersion(void) { return "2.0"; }
FMI2 fmi2Status fmi2SetDebugLogging(fmi2Component x, fmi2Boolean on, size_t n, const fmi2String list[]) {
  (void)x, (void)on, (void)n, (void)list;
  return fmi2OK;
}

FMI2 fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                   const fmi2CallbackFunctions *calls, fmi2Boolean visible, fmi2Boolean logging) {
  component *c;
  (void)resources, (void)visible, (void)logging;
  if (type != fmi2CoSimulation || !guid || strcmp(guid, GUID) != 0) {
    if (calls && calls->logger)
      calls->logger(calls->componentEnvironment, name, fmi2Error, "logStatusError", "%s",
                    type != fmi2CoSimulation ? "for co-simulation alone" : "the guid is of another model");
    return 0;
  }
  c = (component *)calloc(1, sizeof *c);
  if (!c) return 0;
  c->name = (char *)malloc(strlen(name ? name : "") + 1);
  if (!c->name) return free(c), (fmi2Component)0;
  strcpy(c->name, name ? name : "");
  c->calls = calls;
  c->p = emtb_model;
  return c;
}
FMI2 void fmi2FreeInstance(fmi2Component x) {
  if (x) free(((component *)x)->name);
  free(x);
}

FMI2 fmi2Status fmi2SetupExperiment(fmi2Component x, fmi2Boolean bounded, fmi2Real tolerance, fmi2Real start,
                                    fmi2Boolean ends, fmi2Real stop) {
  (void)x, (void)bounded, (void)tolerance, (void)start, (void)ends, (void)stop;
  return fmi2OK;
}
FMI2 fmi2Status fmi2EnterInitializationMode(fmi2Component x) { return x ? fmi2OK : fmi2Error; }
FMI2 fmi2Status fmi2ExitInitializationMode(fmi2Component x) {
  begin((component *)x);
  return fmi2OK;
}
FMI2 fmi2Status fmi2Terminate(fmi2Component x) { return x ? fmi2OK : fmi2Error; }
FMI2 fmi2Status fmi2Reset(fmi2Component x) {
  component *c = (component *)x;
  const emtb_state rest = {0};
  c->s = rest;
  c->p = emtb_model;
  c->u = c->load = 0;
  c->started = 0;
  return fmi2OK;
}

FMI2 fmi2Status fmi2GetReal(fmi2Component x, const fmi2ValueReference list[], size_t n, fmi2Real value[]) {
  component *c = (component *)x;
  size_t k;
  if (!c->started) begin(c), c->started = 0; /* initial outputs follow the inputs that are set */
  for (k = 0; k < n; ++k) {
    const double *at = place(c, list[k]);
    if (!at) return complain(c, "fmi2GetReal: no such variable");
    value[k] = *at;
  }
  return fmi2OK;
}
FMI2 fmi2Status fmi2SetReal(fmi2Component x, const fmi2ValueReference list[], size_t n, const fmi2Real value[]) {
  component *c = (component *)x;
  size_t k;
  for (k = 0; k < n; ++k) {
    double *at = place(c, list[k]);
    if (!at || !may_set(list[k])) return complain(c, "fmi2SetReal: no such input or parameter");
    *at = value[k];
  }
  return fmi2OK;
}

FMI2 fmi2Status fmi2DoStep(fmi2Component x, fmi2Real at, fmi2Real size, fmi2Boolean final) {
  component *c = (component *)x;
  long steps, k;
  (void)at, (void)final;
  if (!(size > 0) || size / longest > 1e9) return complain(c, "fmi2DoStep: the step must be above 0");
  if (!c->started) return complain(c, "fmi2DoStep: not initialized");
  steps = (long)ceil(size / longest * (1 - 1e-9));
  for (k = 0; k < steps; ++k) emtb_step(&c->s, &c->p, c->u, c->load, size / (double)steps);
  if (!(fabs(c->s.omega) < HUGE_VAL)) return complain(c, "fmi2DoStep: the speed is not finite");
  return fmi2OK;
}
FMI2 fmi2Status fmi2CancelStep(fmi2Component x) { return complain((component *)x, "fmi2CancelStep: steps do not wait"); }

FMI2 fmi2Status fmi2GetFMUstate(fmi2Component x, fmi2FMUstate *state) {
  if (!*state) *state = malloc(sizeof(component));
  if (!*state) return fmi2Error;
  memcpy(*state, x, sizeof(component));
  return fmi2OK;
}
FMI2 fmi2Status fmi2SetFMUstate(fmi2Component x, fmi2FMUstate state) {
  component *c = (component *)x;
  const component *from = (const component *)state;
  c->s = from->s, c->p = from->p, c->u = from->u, c->load = from->load, c->started = from->started;
  return fmi2OK;
}
FMI2 fmi2Status fmi2FreeFMUstate(fmi2Component x, fmi2FMUstate *state) {
  (void)x;
  free(*state);
  *state = 0;
  return fmi2OK;
}

/* What this FMU does not have, as modelDescription.xml says. */
#if defined __GNUC__
#define UNUSED __attribute__((unused))
#else
#define UNUSED
#endif
#define HAS_NONE(name, ...) \
  FMI2 fmi2Status name(fmi2Component x, __VA_ARGS__) { return complain((component *)x, #name ": not here"); }
#define NO_VARIABLES(kind, type) \
  FMI2 fmi2Status fmi2Get##kind(fmi2Component x, const fmi2ValueReference l[], size_t n, type v[]) { \
    (void)l, (void)v; \
    return n == 0 ? fmi2OK : complain((component *)x, "fmi2Get" #kind ": all variables are real"); \
  } \
  FMI2 fmi2Status fmi2Set##kind(fmi2Component x, const fmi2ValueReference l[], size_t n, const type v[]) { \
    (void)l, (void)v; \
    return n == 0 ? fmi2OK : complain((component *)x, "fmi2Set" #kind ": all variables are real"); \
  }
NO_VARIABLES(Integer, fmi2Integer)
NO_VARIABLES(Boolean, fmi2Boolean)
NO_VARIABLES(String, fmi2String)
HAS_NONE(fmi2SerializedFMUstateSize, UNUSED fmi2FMUstate s, UNUSED size_t *n)
HAS_NONE(fmi2SerializeFMUstate, UNUSED fmi2FMUstate s, UNUSED fmi2Byte b[], UNUSED size_t n)
HAS_NONE(fmi2DeSerializeFMUstate, UNUSED const fmi2Byte b[], UNUSED size_t n, UNUSED fmi2FMUstate *s)
HAS_NONE(fmi2GetDirectionalDerivative, UNUSED const fmi2ValueReference u[], UNUSED size_t nu,
         UNUSED const fmi2ValueReference k[], UNUSED size_t nk, UNUSED const fmi2Real dk[], UNUSED fmi2Real du[])
HAS_NONE(fmi2SetRealInputDerivatives, UNUSED const fmi2ValueReference l[], UNUSED size_t n, UNUSED const fmi2Integer o[],
         UNUSED const fmi2Real v[])
HAS_NONE(fmi2GetRealOutputDerivatives, UNUSED const fmi2ValueReference l[], UNUSED size_t n,
         UNUSED const fmi2Integer o[], UNUSED fmi2Real v[])
HAS_NONE(fmi2GetStatus, UNUSED const int kind, UNUSED fmi2Status *v)
HAS_NONE(fmi2GetRealStatus, UNUSED const int kind, UNUSED fmi2Real *v)
HAS_NONE(fmi2GetIntegerStatus, UNUSED const int kind, UNUSED fmi2Integer *v)
HAS_NONE(fmi2GetBooleanStatus, UNUSED const int kind, UNUSED fmi2Boolean *v)
HAS_NONE(fmi2GetStringStatus, UNUSED const int kind, UNUSED fmi2String *v)
)";

}  // namespace emtb
