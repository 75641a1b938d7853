#include "backlash_diagnosis/simulation/integrator.h"

#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "backlash_diagnosis/base/error.h"

namespace backlash {
namespace {

constexpr long kMaxStepsPerCall = 10'000'000;

const std::map<std::string, ARKODE_ERKTableID>& explicit_tables() {
  static const std::map<std::string, ARKODE_ERKTableID> tables = {
      {"bogacki_shampine", ARKODE_BOGACKI_SHAMPINE_4_2_3}, {"cash_karp", ARKODE_CASH_KARP_6_4_5},
      {"dormand_prince", ARKODE_DORMAND_PRINCE_7_4_5},     {"verner", ARKODE_VERNER_8_5_6},
      {"fehlberg", ARKODE_FEHLBERG_6_4_5}};
  return tables;
}

// Errors are reported through return codes; the library's own printing to stderr would only repeat them.
void silence(int, const char*, const char*, char*, void*) {}

}  // namespace

const std::vector<std::string>& integrator_methods() {
  static const std::vector<std::string> methods = [] {
    std::vector<std::string> names;
    for (const auto& [name, table] : explicit_tables()) names.push_back(name);
    names.insert(names.end(), {"bdf", "adams"});
    return names;
  }();
  return methods;
}

SolverSettings read_solver(const YamlReader& yaml) {
  SolverSettings settings;
  settings.method = yaml.choice("method", integrator_methods());
  settings.relative_tolerance = yaml.number("relative_tolerance", Range::between(1e-13, 1e-1));
  settings.position_tolerance = yaml.number("position_tolerance", Range::positive());
  settings.velocity_tolerance = yaml.number("velocity_tolerance", Range::positive());
  return settings;
}

struct Integrator::Impl {
  Impl(Derivative f, std::vector<double> tolerances, const SolverSettings& s);
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void create_explicit(double t);
  void create_multistep(double t);
  void collect();
  /// Negative return codes are errors; positive ones tell why the solver returned.
  int check(int code, const char* function) const;

  Derivative derivative;
  SolverSettings settings;
  bool multistep;
  SUNContext context = nullptr;
  N_Vector state = nullptr, tolerances = nullptr;
  SUNMatrix matrix = nullptr;
  SUNLinearSolver linear_solver = nullptr;
  SUNNonlinearSolver nonlinear_solver = nullptr;
  void* memory = nullptr;
  double time = 0;
  IntegratorStatistics before_restart;  // the solvers' counters start again at each reset
};

namespace {

int evaluate(realtype t, N_Vector y, N_Vector ydot, void* user) {
  const auto& derivative = *static_cast<const Integrator::Derivative*>(user);
  derivative(t, N_VGetArrayPointer(y), N_VGetArrayPointer(ydot));
  return 0;
}

}  // namespace

Integrator::Impl::Impl(Derivative f, std::vector<double> absolute, const SolverSettings& s)
    : derivative(std::move(f)), settings(s), multistep(s.method == "bdf" || s.method == "adams") {
  if (!multistep && !explicit_tables().count(s.method))
    throw InvalidParameter("solver.method", s.method, "is not a known method");
  if (!(s.relative_tolerance > 0)) throw InvalidParameter("solver.relative_tolerance", s.relative_tolerance, "must be > 0");
  for (double tolerance : absolute)
    if (!(tolerance > 0)) throw InvalidParameter("solver absolute tolerance", tolerance, "must be > 0");
  check(SUNContext_Create(nullptr, &context), "SUNContext_Create");
  state = N_VNew_Serial(static_cast<sunindextype>(absolute.size()), context);
  tolerances = N_VNew_Serial(static_cast<sunindextype>(absolute.size()), context);
  if (!state || !tolerances) throw IntegrationError("N_VNew_Serial: out of memory");
  N_VEnableFusedOps_Serial(state, SUNTRUE);
  std::copy(absolute.begin(), absolute.end(), N_VGetArrayPointer(tolerances));
}

Integrator::Impl::~Impl() {
  if (memory) multistep ? CVodeFree(&memory) : ERKStepFree(&memory);
  if (nonlinear_solver) SUNNonlinSolFree(nonlinear_solver);
  if (linear_solver) SUNLinSolFree(linear_solver);
  if (matrix) SUNMatDestroy(matrix);
  if (tolerances) N_VDestroy(tolerances);
  if (state) N_VDestroy(state);
  if (context) SUNContext_Free(&context);
}

int Integrator::Impl::check(int code, const char* function) const {
  if (code >= 0) return code;
  char* name = multistep ? CVodeGetReturnFlagName(code) : ERKStepGetReturnFlagName(code);
  std::ostringstream text;
  text << settings.method << ": " << function << " returned " << (name ? name : "?") << " (" << code << ") at t = " << time
       << " s";
  free(name);
  throw IntegrationError(text.str());
}

void Integrator::Impl::create_explicit(double t) {
  memory = ERKStepCreate(evaluate, t, state, context);
  if (!memory) throw IntegrationError("ERKStepCreate failed");
  check(ERKStepSetErrHandlerFn(memory, silence, nullptr), "ERKStepSetErrHandlerFn");
  check(ERKStepSetTableNum(memory, explicit_tables().at(settings.method)), "ERKStepSetTableNum");
  check(ERKStepSVtolerances(memory, settings.relative_tolerance, tolerances), "ERKStepSVtolerances");
  check(ERKStepSetUserData(memory, &derivative), "ERKStepSetUserData");
  check(ERKStepSetMaxNumSteps(memory, kMaxStepsPerCall), "ERKStepSetMaxNumSteps");
}

void Integrator::Impl::create_multistep(double t) {
  const bool stiff = settings.method == "bdf";
  memory = CVodeCreate(stiff ? CV_BDF : CV_ADAMS, context);
  if (!memory) throw IntegrationError("CVodeCreate failed");
  check(CVodeSetErrHandlerFn(memory, silence, nullptr), "CVodeSetErrHandlerFn");
  check(CVodeInit(memory, evaluate, t, state), "CVodeInit");
  check(CVodeSVtolerances(memory, settings.relative_tolerance, tolerances), "CVodeSVtolerances");
  check(CVodeSetUserData(memory, &derivative), "CVodeSetUserData");
  check(CVodeSetMaxNumSteps(memory, kMaxStepsPerCall), "CVodeSetMaxNumSteps");
  if (stiff) {  // Newton with a dense difference-quotient Jacobian
    const sunindextype n = N_VGetLength(state);
    matrix = SUNDenseMatrix(n, n, context);
    linear_solver = SUNLinSol_Dense(state, matrix, context);
    check(CVodeSetLinearSolver(memory, linear_solver, matrix), "CVodeSetLinearSolver");
  } else {
    nonlinear_solver = SUNNonlinSol_FixedPoint(state, 0, context);
    check(CVodeSetNonlinearSolver(memory, nonlinear_solver), "CVodeSetNonlinearSolver");
  }
}

void Integrator::Impl::collect() {
  long steps = 0, evaluations = 0, failures = 0;
  if (multistep) {
    CVodeGetNumSteps(memory, &steps);
    CVodeGetNumRhsEvals(memory, &evaluations);
    CVodeGetNumErrTestFails(memory, &failures);
  } else {
    ERKStepGetNumSteps(memory, &steps);
    ERKStepGetNumRhsEvals(memory, &evaluations);
    ERKStepGetNumErrTestFails(memory, &failures);
  }
  before_restart.steps += steps;
  before_restart.evaluations += evaluations;
  before_restart.error_test_failures += failures;
}

Integrator::Integrator(Derivative derivative, std::vector<double> absolute_tolerances, const SolverSettings& settings)
    : impl_(std::make_unique<Impl>(std::move(derivative), std::move(absolute_tolerances), settings)) {}
Integrator::~Integrator() = default;
Integrator::Integrator(Integrator&&) noexcept = default;
Integrator& Integrator::operator=(Integrator&&) noexcept = default;

void Integrator::restart(double t, const double* state, double stop) {
  Impl& s = *impl_;
  std::copy(state, state + N_VGetLength(s.state), N_VGetArrayPointer(s.state));
  s.time = t;
  if (!s.memory) {
    s.multistep ? s.create_multistep(t) : s.create_explicit(t);
  } else {
    s.collect();
    if (s.multistep)
      s.check(CVodeReInit(s.memory, t, s.state), "CVodeReInit");
    else  // a reset keeps the error controller's memory of the last segment; a new initial step must be found
      s.check(ERKStepReInit(s.memory, evaluate, t, s.state), "ERKStepReInit");
  }
  // Set after each restart: ERKStep forgets the stop time, CVODE keeps the old one.
  const double last = std::isfinite(stop) ? stop : 1e300;
  if (s.multistep)
    s.check(CVodeSetStopTime(s.memory, last), "CVodeSetStopTime");
  else
    s.check(ERKStepSetStopTime(s.memory, last), "ERKStepSetStopTime");
}

void Integrator::integrate_to(double t, double* state) {
  Impl& s = *impl_;
  if (t > s.time) {
    double reached = s.time;
    if (s.multistep)
      s.check(CVode(s.memory, t, s.state, &reached, CV_NORMAL), "CVode");
    else
      s.check(ERKStepEvolve(s.memory, t, s.state, &reached, ARK_NORMAL), "ERKStepEvolve");
    s.time = reached;
  }
  const double* values = N_VGetArrayPointer(s.state);
  for (sunindextype i = 0; i < N_VGetLength(s.state); ++i)
    if (!std::isfinite(values[i])) {
      std::ostringstream text;
      text << s.settings.method << ": state " << i << " is not finite at t = " << s.time << " s";
      throw IntegrationError(text.str());
    }
  std::copy(values, values + N_VGetLength(s.state), state);
}

IntegratorStatistics Integrator::statistics() const {
  IntegratorStatistics total = impl_->before_restart;
  if (!impl_->memory) return total;
  IntegratorStatistics saved = impl_->before_restart;
  impl_->collect();
  std::swap(saved, impl_->before_restart);
  return saved;
}

}  // namespace backlash
