// SPDX-License-Identifier: BSD-3-Clause
// The terms that the registry in term.cpp lists; one file each in this folder.
#pragma once

#include "backlash_diagnosis/model/term.h"

namespace backlash::model {

TermType asymmetric_coulomb_term();
TermType asymmetric_viscous_term();
TermType backlash_term();
TermType backlash_map_term();
TermType cogging_term();
TermType delay_term();
TermType eccentricity_term();
TermType encoder_scale_term();
TermType friction_drift_term();
TermType gravity_term();
TermType learned_map_term();
TermType load_dependent_friction_term();
TermType local_fault_term();
TermType mesh_hardening_term();
TermType mesh_hysteresis_term();
TermType position_dependent_friction_term();
TermType quadratic_drag_term();
TermType square_root_friction_term();
TermType presliding_term();
TermType radial_compliance_term();
TermType stribeck_term();
TermType transmission_error_term();
TermType varying_backlash_term();
TermType varying_reduction_ratio_term();

}  // namespace backlash::model
