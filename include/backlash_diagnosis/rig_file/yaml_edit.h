// SPDX-License-Identifier: BSD-3-Clause
// Changing single values of a YAML file while its layout and its other comments stay: how a program writes a
// rig file that a person can still read.
#pragma once

#include <string>

namespace backlash {

/// `text` with the scalar under `key` ("gear_train.motor.inertia": maps in block style, each key on a line of
/// its own) replaced by `value`. A key that is absent is added as the first of its map, which must exist.
/// `comment` replaces the comment of that line; empty: the old one stays. `name` is for messages. Throws
/// BadData where the text is no YAML map, where a map on the way is absent, and where key and value do not
/// share a line that holds nothing else.
std::string with_yaml_value(const std::string& text, const std::string& name, const std::string& key,
                            const std::string& value, const std::string& comment = "");

}  // namespace backlash
