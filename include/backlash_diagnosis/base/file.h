// SPDX-License-Identifier: BSD-3-Clause
// Opening files for reading and writing them whole, with errors that name the file and the reason.
#pragma once

#include <fstream>
#include <string>
#include <string_view>

namespace backlash {

/// A binary input stream; throws MissingInput when the file does not exist, is a directory or cannot be
/// opened.
std::ifstream open_input(const std::string& path);

/// The first `most` bytes of a file: a device or a file of another kind must not fill the memory. Throws
/// MissingInput.
std::string read_start(const std::string& path, std::size_t most);

/// Writes the file whole or not at all: into a temporary file beside it, then renamed, so that no reader ever
/// sees half a file and an old one survives a full disk. A symbolic link stays and its target is replaced;
/// devices and pipes are written directly. Throws CannotWrite and leaves nothing behind.
void write_file(const std::string& path, std::string_view content);

}  // namespace backlash
