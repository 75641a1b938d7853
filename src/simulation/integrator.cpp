// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/simulation/integrator.h"

#include <fmt/core.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "small_vector.h"
#include "sundials_versions.h"
#include "tsitouras.h"
#include "work_limit.h"

namespace backlash::simulation {
namespace {

// A trial step may reach where the derivative overflows, and a shorter one mends that; more than a few of
// them are a wall, before which the solvers would try ever shorter steps up to the limit above.
constexpr long kMaxNotFinitePerCall = 1000;

// Each makes the step at least 0.3 times as long. The library's own 7 do not get from a step that suits a
// smooth motion to one that suits a jump of the damping where teeth touch.
constexpr int kMaxFailuresPerStep = 30;

const std::map<std::string, ARKODE_ERKTableID>& explicit_tables() {
  static const std::map<std::string, ARKODE_ERKTableID> tables = {
      {"bogacki_shampine", ARKODE_BOGACKI_SHAMPINE_4_2_3},
      {"cash_karp", ARKODE_CASH_KARP_6_4_5},
      {"dormand_prince", ARKODE_DORMAND_PRINCE_7_4_5},
      {"fehlberg", ARKODE_FEHLBERG_6_4_5}};
  return tables;
}

// Verner's 6(5) pair with its solution appended as a ninth stage. SUNDIALS before 6.6.2 takes every table
// whose last stage lies at the end of the step for "first same as last", and would start each step with the
// derivative at that stage instead of at the solution: order 3 instead of 6. With the ninth stage the
// assumption holds, at no more evaluations per step.
ARKodeButcherTable verner_first_same_as_last() {
  ARKodeButcherTable pair = ARKodeButcherTable_LoadERK(ARKODE_VERNER_8_5_6);
  if (!pair) return nullptr;
  const int n = pair->stages, m = n + 1;
  std::vector<double> a(m * m), b(m), c(m), embedded(m);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) a[i * m + j] = pair->A[i][j];
    a[n * m + i] = b[i] = pair->b[i];
    c[i] = pair->c[i];
    embedded[i] = pair->d[i];
  }
  c[n] = 1;
  ARKodeButcherTable table =
      ARKodeButcherTable_Create(m, pair->q, pair->p, c.data(), a.data(), b.data(), embedded.data());
  ARKodeButcherTable_Free(pair);
  return table;
}

ARKodeButcherTable tsitouras_table() {
  std::vector<double> a, b, c, embedded;
  for (int i = 0; i < tsitouras::kStages; ++i) {
    a.insert(a.end(), tsitouras::kA[i], tsitouras::kA[i] + tsitouras::kStages);
    b.push_back(tsitouras::kA[tsitouras::kStages - 1][i]);
    c.push_back(tsitouras::kC[i]);
    embedded.push_back(b.back() - tsitouras::kError[i]);
  }
  return ARKodeButcherTable_Create(tsitouras::kStages, 5, 4, c.data(), a.data(), b.data(), embedded.data());
}

/// Those that are not in the library as they are needed here.
const std::map<std::string, ARKodeButcherTable (*)()>& own_tables() {
  static const std::map<std::string, ARKodeButcherTable (*)()> tables = {
      {"tsitouras", tsitouras_table}, {"verner", verner_first_same_as_last}};
  return tables;
}

/// Times closer to t than this are the same: the solvers refuse so short a way, and no state changes within
/// it.
double rounding(double t) {
  return 8 * std::numeric_limits<double>::epsilon() * std::fabs(t);
}

IntegratorStatistics operator+(const IntegratorStatistics& a, const IntegratorStatistics& b) {
  return {a.steps + b.steps, a.evaluations + b.evaluations, a.error_test_failures + b.error_test_failures};
}

}  // namespace

const std::vector<std::string>& integrator_methods() {
  static const std::vector<std::string> methods = [] {
    std::vector<std::string> names;
    for (const auto& [name, table] : explicit_tables()) names.push_back(name);
    for (const auto& [name, table] : own_tables()) names.push_back(name);
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
  Impl(Derivative f, std::vector<StateTolerance> t, const SolverSettings& s, Events e, int count);
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void create_explicit(double t);
  void create_multistep(double t);
  void find_events();
  void restart(double t);
  int evolve(double t);
  int risen() const;
  void refuse_unreachable(double t) const;
  void require_finite() const;
  IntegratorStatistics since_restart() const;
  /// Negative return codes are errors; positive ones say why the solver returned.
  void check(int code, const char* function) const;
  [[noreturn]] void fail(const std::string& what) const;

  /// Calls what must not throw through the solver's C frames.
  template <typename Function>
  int guarded(Function function);

  Derivative derivative;
  Events events;
  int event_count;
  SolverSettings settings;
  bool multistep;
  SUNContext context = nullptr;
  N_Vector state = nullptr;
  std::vector<StateTolerance> tolerances;
  SUNMatrix matrix = nullptr;
  SUNLinearSolver linear_solver = nullptr;
  SUNNonlinearSolver nonlinear_solver = nullptr;
  void* memory = nullptr;
  double time = 0, stop = 0, longest_step = 0, first_step = 0;
  long not_finite = 0;                  // derivatives of this call
  std::exception_ptr thrown;            // by the derivative: it must not pass through the solver's C frames
  IntegratorStatistics before_restart;  // the solvers' counters start again at each reset

  static int evaluate(sunrealtype t, N_Vector y, N_Vector ydot, void* user);
  static int evaluate_events(sunrealtype t, N_Vector y, sunrealtype* values, void* user);
  static int weigh(N_Vector y, N_Vector weights, void* user);
};

template <typename Function>
int Integrator::Impl::guarded(Function function) {
  if (thrown) return -1;  // the fixed-point iteration takes any failure for one that a smaller step mends
  try {
    function();
    return 0;
  } catch (...) {
    thrown = std::current_exception();
    return -1;
  }
}

int Integrator::Impl::evaluate(sunrealtype t, N_Vector y, N_Vector ydot, void* user) {
  Impl& self = *static_cast<Impl*>(user);
  return self.guarded([&] {
    double* const rate = NV_DATA_S(ydot);
    self.derivative(t, NV_DATA_S(y), rate);
    double sum = 0;  // not finite as soon as one of them is not
    for (std::size_t i = 0; i < self.tolerances.size(); ++i) sum += rate[i];
    if (!std::isfinite(sum) && ++self.not_finite > kMaxNotFinitePerCall)
      self.fail("the derivative is not finite");
  });
}

int Integrator::Impl::evaluate_events(sunrealtype t, N_Vector y, sunrealtype* values, void* user) {
  Impl& self = *static_cast<Impl*>(user);
  return self.guarded([&] { self.events(t, NV_DATA_S(y), values); });
}

int Integrator::Impl::weigh(N_Vector y, N_Vector weights, void* user) {
  const Impl& self = *static_cast<Impl*>(user);
  const double* const values = NV_DATA_S(y);
  double* const out = NV_DATA_S(weights);
  for (std::size_t i = 0; i < self.tolerances.size(); ++i) {
    const StateTolerance& t = self.tolerances[i];
    out[i] = 1 / (t.absolute + self.settings.relative_tolerance * std::min(std::fabs(values[i]), t.largest));
  }
  return 0;
}

Integrator::Impl::Impl(Derivative f, std::vector<StateTolerance> t, const SolverSettings& s, Events e,
                       int count)
    : derivative(std::move(f)),
      events(std::move(e)),
      event_count(count),
      settings(s),
      multistep(s.method == "bdf" || s.method == "adams") {
  if (!multistep && !explicit_tables().count(s.method) && !own_tables().count(s.method))
    throw InvalidParameter("solver.method", s.method, "is not a known method");
  const auto require_tolerance = [](const char* name, double value) {
    if (!Range::positive().contains(value)) throw InvalidParameter(name, value, "must be > 0 and finite");
  };
  require_tolerance("solver.relative_tolerance", s.relative_tolerance);
  for (const StateTolerance& each : t) require_tolerance("solver absolute tolerance", each.absolute);
  tolerances = std::move(t);
  check(sundials::create_context(&context), "SUNContext_Create");
  const auto length = static_cast<sunindextype>(tolerances.size());
  state = multistep ? N_VNew_Serial(length, context) : new_small_vector(length, context);
  if (!state) throw IntegrationError("N_VNew_Serial: out of memory");
  if (multistep) check(N_VEnableFusedOps_Serial(state, SUNTRUE), "N_VEnableFusedOps_Serial");
}

Integrator::Impl::~Impl() {
  if (memory) multistep ? CVodeFree(&memory) : ARKodeFree(&memory);
  if (nonlinear_solver) SUNNonlinSolFree(nonlinear_solver);
  if (linear_solver) SUNLinSolFree(linear_solver);
  if (matrix) SUNMatDestroy(matrix);
  if (state) N_VDestroy(state);
  if (context) SUNContext_Free(&context);
}

void Integrator::Impl::fail(const std::string& what) const {
  double reached = time;  // where the solver is now; an error here leaves the time before
  if (memory) multistep ? CVodeGetCurrentTime(memory, &reached) : ARKodeGetCurrentTime(memory, &reached);
  throw IntegrationError(fmt::format("{}: {} at t = {:.12g} s", settings.method, what, reached));
}

void Integrator::Impl::check(int code, const char* function) const {
  if (code >= 0) return;
  char* name = multistep ? CVodeGetReturnFlagName(code) : ARKodeGetReturnFlagName(code);
  const std::string word = name ? name : "?";
  free(name);
  static_assert(CV_TOO_MUCH_WORK == ARK_TOO_MUCH_WORK, "one code for both solvers");
  fail(std::string(function) + " returned " + word + " (" + std::to_string(code) + ")" +
       (code == CV_TOO_MUCH_WORK ? std::string(", ") + kTooStiff : ""));
}

void Integrator::Impl::create_explicit(double t) {
  memory = ERKStepCreate(evaluate, t, state, context);
  if (!memory) throw IntegrationError("ERKStepCreate failed");
  check(sundials::silence_explicit(memory), "silencing ERKStep");
  if (const auto own = own_tables().find(settings.method); own != own_tables().end()) {
    const std::unique_ptr<ARKodeButcherTableMem, void (*)(ARKodeButcherTable)> table(own->second(),
                                                                                     ARKodeButcherTable_Free);
    check(ERKStepSetTable(memory, table.get()), "ERKStepSetTable");
  } else {
    check(ERKStepSetTableNum(memory, explicit_tables().at(settings.method)), "ERKStepSetTableNum");
  }
  check(ARKodeWFtolerances(memory, weigh), "ARKodeWFtolerances");
  check(ARKodeSetUserData(memory, this), "ARKodeSetUserData");
  check(ARKodeSetMaxNumSteps(memory, kMaxStepsPerCall), "ARKodeSetMaxNumSteps");
  check(ARKodeSetMaxErrTestFails(memory, kMaxFailuresPerStep), "ARKodeSetMaxErrTestFails");
}

void Integrator::Impl::create_multistep(double t) {
  const bool stiff = settings.method == "bdf";
  memory = CVodeCreate(stiff ? CV_BDF : CV_ADAMS, context);
  if (!memory) throw IntegrationError("CVodeCreate failed");
  check(sundials::silence_multistep(memory), "silencing CVODE");
  check(CVodeInit(memory, evaluate, t, state), "CVodeInit");
  check(CVodeWFtolerances(memory, weigh), "CVodeWFtolerances");
  check(CVodeSetUserData(memory, this), "CVodeSetUserData");
  check(CVodeSetMaxNumSteps(memory, kMaxStepsPerCall), "CVodeSetMaxNumSteps");
  if (stiff) {  // Newton with a dense difference-quotient Jacobian
    const sunindextype n = NV_LENGTH_S(state);
    matrix = SUNDenseMatrix(n, n, context);
    linear_solver = SUNLinSol_Dense(state, matrix, context);
    check(CVodeSetLinearSolver(memory, linear_solver, matrix), "CVodeSetLinearSolver");
  } else {
    nonlinear_solver = SUNNonlinSol_FixedPoint(state, 0, context);
    check(CVodeSetNonlinearSolver(memory, nonlinear_solver), "CVodeSetNonlinearSolver");
  }
}

void Integrator::Impl::find_events() {
  std::vector<int> rising(event_count, 1);
  if (multistep) {
    check(CVodeRootInit(memory, event_count, evaluate_events), "CVodeRootInit");
    check(CVodeSetRootDirection(memory, rising.data()), "CVodeSetRootDirection");
    check(CVodeSetNoInactiveRootWarn(memory), "CVodeSetNoInactiveRootWarn");
  } else {
    check(ARKodeRootInit(memory, event_count, evaluate_events), "ARKodeRootInit");
    check(ARKodeSetRootDirection(memory, rising.data()), "ARKodeSetRootDirection");
    check(ARKodeSetNoInactiveRootWarn(memory), "ARKodeSetNoInactiveRootWarn");
  }
}

IntegratorStatistics Integrator::Impl::since_restart() const {
  IntegratorStatistics count;
  if (multistep) {
    check(CVodeGetNumSteps(memory, &count.steps), "CVodeGetNumSteps");
    check(CVodeGetNumRhsEvals(memory, &count.evaluations), "CVodeGetNumRhsEvals");
    check(CVodeGetNumErrTestFails(memory, &count.error_test_failures), "CVodeGetNumErrTestFails");
    if (linear_solver) {
      long for_jacobian = 0;
      check(CVodeGetNumLinRhsEvals(memory, &for_jacobian), "CVodeGetNumLinRhsEvals");
      count.evaluations += for_jacobian;
    }
  } else {
    check(ARKodeGetNumSteps(memory, &count.steps), "ARKodeGetNumSteps");
    check(ERKStepGetNumRhsEvals(memory, &count.evaluations), "ERKStepGetNumRhsEvals");
    check(ARKodeGetNumErrTestFails(memory, &count.error_test_failures), "ARKodeGetNumErrTestFails");
  }
  return count;
}

void Integrator::Impl::restart(double t) {
  if (!memory) {
    multistep ? create_multistep(t) : create_explicit(t);
    if (event_count > 0) find_events();
  } else {
    before_restart = before_restart + since_restart();
    if (multistep)
      check(CVodeReInit(memory, t, state), "CVodeReInit");
    else  // a reset keeps the error controller's memory of the last segment; a new initial step must be found
      check(ERKStepReInit(memory, evaluate, t, state), "ERKStepReInit");
  }
  // Set after each restart: ERKStep forgets the stop time, CVODE keeps the old one.
  const double last = std::isfinite(stop) ? stop : 1e300;
  const double longest = std::isfinite(longest_step) ? longest_step : 0;  // 0: any
  if (multistep) {
    check(CVodeSetStopTime(memory, last), "CVodeSetStopTime");
    check(CVodeSetMaxStep(memory, longest), "CVodeSetMaxStep");
    check(CVodeSetInitStep(memory, first_step), "CVodeSetInitStep");
  } else {
    check(ARKodeSetStopTime(memory, last), "ARKodeSetStopTime");
    check(ARKodeSetMaxStep(memory, longest), "ARKodeSetMaxStep");
    check(ARKodeSetInitStep(memory, first_step), "ARKodeSetInitStep");
  }
}

void Integrator::Impl::refuse_unreachable(double t) const {
  const char* reason = !memory                     ? "needs a restart() first"
                       : !std::isfinite(t)         ? "is not finite"
                       : t < time - rounding(time) ? "lies before the last returned time"
                       : t > stop + rounding(stop) ? "lies beyond the stop time"
                                                   : nullptr;
  if (!reason) return;
  fail(fmt::format("cannot integrate to t = {:.17g} s, which {}; now", t, reason));
}

int Integrator::Impl::risen() const {
  std::vector<int> found(event_count);
  if (multistep)
    check(CVodeGetRootInfo(memory, found.data()), "CVodeGetRootInfo");
  else
    check(ARKodeGetRootInfo(memory, found.data()), "ARKodeGetRootInfo");
  return static_cast<int>(std::find(found.begin(), found.end(), 1) - found.begin());
}

int Integrator::Impl::evolve(double t) {
  if (t - time <= rounding(t)) return kNoEvent;
  double reached = time;
  thrown = nullptr;
  not_finite = 0;
  const int code = multistep ? CVode(memory, std::min(t, stop), state, &reached, CV_NORMAL)
                             : ARKodeEvolve(memory, std::min(t, stop), state, &reached, ARK_NORMAL);
  if (thrown) std::rethrow_exception(std::exchange(thrown, nullptr));
  check(code, multistep ? "CVode" : "ARKodeEvolve");
  time = reached;
  static_assert(CV_ROOT_RETURN == ARK_ROOT_RETURN, "one name for both solvers");
  return code == CV_ROOT_RETURN ? risen() : kNoEvent;
}

void Integrator::Impl::require_finite() const {
  const double* values = NV_DATA_S(state);
  for (sunindextype i = 0; i < NV_LENGTH_S(state); ++i)
    if (!std::isfinite(values[i])) fail("state " + std::to_string(i) + " is not finite");
}

Integrator::Integrator(Derivative derivative, std::vector<StateTolerance> tolerances,
                       const SolverSettings& settings, Events events, int event_count)
    : impl_(std::make_unique<Impl>(std::move(derivative), std::move(tolerances), settings, std::move(events),
                                   event_count)) {}
Integrator::~Integrator() = default;
Integrator::Integrator(Integrator&&) noexcept = default;
Integrator& Integrator::operator=(Integrator&&) noexcept = default;

void Integrator::restart(double t, const double* state, double stop, double longest_step, double first_step) {
  Impl& s = *impl_;
  std::copy(state, state + NV_LENGTH_S(s.state), NV_DATA_S(s.state));
  s.time = t;
  s.stop = stop;
  s.longest_step = longest_step;
  s.first_step = first_step;
  s.restart(t);
}

int Integrator::integrate_to(double t, double* state) {
  Impl& s = *impl_;
  s.refuse_unreachable(t);
  const int event = s.evolve(t);
  s.require_finite();
  const double* values = NV_DATA_S(s.state);
  std::copy(values, values + NV_LENGTH_S(s.state), state);
  return event;
}

double Integrator::time() const {
  return impl_->time;
}

IntegratorStatistics Integrator::statistics() const {
  return impl_->memory ? impl_->before_restart + impl_->since_restart() : impl_->before_restart;
}

}  // namespace backlash::simulation
