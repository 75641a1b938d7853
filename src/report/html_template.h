// SPDX-License-Identifier: BSD-3-Clause
// The templates of the pages, in folder templates, and how they are filled: a small part of Mustache
// (https://mustache.github.io/mustache.5.html).
//
//   {{name}}                   the text, with the characters that HTML takes for its own replaced
//   {{{name}}}                 the text as it is: it is HTML already
//   {{#name}} ... {{/name}}    once for each item of a list, once for another value; not for null, false, an
//                              empty text or list, or a name that the data does not have
//   {{^name}} ... {{/name}}    once where the other would not be there
//
// Names are looked up in the item of the innermost section first. A tag of a section may end a line, which is
// then not in the page.
#pragma once

#include <string>

#include "json.h"

namespace backlash::report {

/// In the library by CMake, from src/report/templates.
extern const char* const kPageTemplate;
extern const char* const kProvenanceTemplate;
extern const char* const kFiguresTemplate;
extern const char* const kWarningsTemplate;
extern const char* const kTraceTemplate;
extern const char* const kDiagnosisTemplate;
extern const char* const kArmTraceTemplate;
extern const char* const kDayTemplate;

/// Throws Error for a tag that does not end, or a text that the data does not have.
std::string filled(const std::string& html_template, const Json& data);

}  // namespace backlash::report
