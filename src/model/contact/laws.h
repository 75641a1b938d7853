// SPDX-License-Identifier: BSD-3-Clause
// The laws that the registry in contact_law.cpp lists; one file each in this folder.
#pragma once

#include "backlash_diagnosis/model/contact_law.h"

namespace backlash::model {

ContactLawType linear_contact();
ContactLawType power_law_contact();
ContactLawType hunt_crossley_contact();
ContactLawType hertz_in_series_contact();
ContactLawType kelvin_voigt_contact();
ContactLawType herbert_mcwhannell_contact();
ContactLawType yang_sun_contact();
ContactLawType lankarani_nikravesh_contact();
ContactLawType jankowski_contact();
ContactLawType stereomechanical_contact();
ContactLawType foundation_contact();

}  // namespace backlash::model
