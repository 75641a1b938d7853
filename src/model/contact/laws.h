// The laws that the registry in contact_law.cpp lists; one file each in this folder.
#pragma once

#include "backlash_diagnosis/model/contact_law.h"

namespace backlash {

ContactLawType linear_contact();
ContactLawType power_law_contact();
ContactLawType hunt_crossley_contact();

}  // namespace backlash
