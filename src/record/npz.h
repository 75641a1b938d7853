// SPDX-License-Identifier: BSD-3-Clause
// NumPy's archives of arrays (.npz): a zip of files NAME.npy.
// https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace backlash::record {

/// One or two dimensions; of one, `columns` is 1 and `rank` 1.
struct NpyArray {
  std::size_t rows = 0, columns = 1, rank = 1;
  std::vector<double> values;  // row by row
  double at(std::size_t row, std::size_t column) const { return values[row * columns + column]; }
};

/// The array in the bytes of a file .npy. Throws BadData with `name`.
NpyArray parse_npy(const std::string& bytes, const std::string& name);

class NpzFile {
 public:
  /// Throws MissingInput, BadData.
  explicit NpzFile(const std::string& path);
  ~NpzFile();
  NpzFile(const NpzFile&) = delete;
  NpzFile& operator=(const NpzFile&) = delete;

  const std::vector<std::string>& names() const { return names_; }  ///< of the arrays

  /// Throws BadData.
  NpyArray array(const std::string& name) const;

 private:
  void read_names();
  void* zip_ = nullptr;
  std::string path_;
  std::vector<std::string> names_;
};

}  // namespace backlash::record
