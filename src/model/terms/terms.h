// The terms that the registry in term.cpp lists; one file each in this folder.
#pragma once

#include "backlash_diagnosis/model/term.h"

namespace backlash {

TermType backlash_map_term();
TermType delay_term();
TermType eccentricity_term();
TermType encoder_scale_term();
TermType gravity_term();
TermType presliding_term();
TermType radial_compliance_term();
TermType transmission_error_term();
TermType varying_backlash_term();
TermType varying_reduction_ratio_term();

}  // namespace backlash
