// SPDX-License-Identifier: BSD-3-Clause
// What a drawn arm does and what its sensors show of it.
#pragma once

#include <string>

#include "blind_arm.h"

namespace blind_arms {

/// Moves the arm for `duration` [s] and writes what its sensors show, columns JOINT/channel, to `path`. Each
/// `number` is another motion with other noise. Throws std::runtime_error.
void make_record(const Arm& arm, double duration, int number, const std::string& path);

/// URDF, rig file and truth (JSON) beside the records. `before`: the arm that the rig file describes.
void write_files(const Arm& arm, const Arm& before, const std::string& folder);

/// Name of a joint in all files.
std::string joint_name(std::size_t joint);

}  // namespace blind_arms
