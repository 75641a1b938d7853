// The terms that the registry in term.cpp lists; one file each in this folder.
#pragma once

#include "backlash_diagnosis/model/term.h"

namespace backlash {

TermType gravity_term();

}  // namespace backlash
