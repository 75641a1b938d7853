// SPDX-License-Identifier: BSD-3-Clause
// rosbag2's SQLite storage: topics(id, name, type, serialization_format, ...) and
// messages(id, topic_id, timestamp, data). Newer versions add columns and tables, which are not asked for.
#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "open_file.h"

namespace backlash::recording {
namespace {

constexpr const char* kTopics = "SELECT id, name, type, serialization_format FROM topics ORDER BY id";

/// A file's name in a URI (RFC 3986): all but plain letters escaped.
std::string uri_of(const std::string& path) {
  std::error_code error;
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path, error).string())
    uri += std::isalnum(static_cast<unsigned char>(c)) || c == '/'
               ? std::string(1, c)
               : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  // Without a journal beside it nobody is writing; then SQLite need not put files of its own there.
  return uri + (std::filesystem::exists(path + "-wal", error) ? "?mode=ro" : "?mode=ro&immutable=1");
}

class Sqlite : public Recording {
 public:
  explicit Sqlite(const std::string& path) : path_(path), damage_(cut_of(path, page_)) {
    const int code =
        sqlite3_open_v2(uri_of(path).c_str(), &database_, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
    if (code != SQLITE_OK) {
      const std::string reason = database_ ? sqlite3_errmsg(database_) : sqlite3_errstr(code);
      sqlite3_close(database_);
      throw MissingInput(path + ": cannot be opened: " + reason);
    }
    sqlite3_limit(database_, SQLITE_LIMIT_LENGTH, static_cast<int>(kMostBytes));
    sqlite3_db_config(database_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(database_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    try {
      if (damage_.empty()) damage_ = damage_of_pages();
      if (!damage_.empty()) take_as_it_is();
      check_tables();
    } catch (...) {
      sqlite3_close(database_);
      throw;
    }
  }
  ~Sqlite() override { sqlite3_close(database_); }
  Sqlite(const Sqlite&) = delete;
  Sqlite& operator=(const Sqlite&) = delete;

  std::vector<Topic> topics() override {
    std::vector<Topic> all;
    each_row(kTopics, [&](sqlite3_stmt* row) { all.push_back({text(row, 1), text(row, 2), text(row, 3)}); });
    return all;
  }

  void read(const std::vector<std::string>& topics, const Take& take) override {
    if (!damage_.empty()) return read_to_damage(topics, take);
    std::map<std::int64_t, std::string> wanted;
    std::string ids;
    each_row(kTopics, [&](sqlite3_stmt* row) {
      const std::string name = text(row, 1);
      if (std::find(topics.begin(), topics.end(), name) == topics.end()) return;
      const std::int64_t id = sqlite3_column_int64(row, 0);
      if (wanted.emplace(id, name).second) ids += fmt::format("{}{}", ids.empty() ? "" : ",", id);
    });
    each_row("SELECT topic_id, data, id, timestamp FROM messages WHERE topic_id IN (" + ids +
                 ") ORDER BY timestamp, id",
             [&](sqlite3_stmt* row) {
               const auto topic = wanted.find(sqlite3_column_int64(row, 0));
               if (topic == wanted.end() || sqlite3_column_type(row, 1) != SQLITE_BLOB)
                 throw BadData(
                     path_, fmt::format("damaged: messages, id {}: no bytes", sqlite3_column_int64(row, 2)));
               const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(row, 1));
               take({topic->second, static_cast<std::uint64_t>(sqlite3_column_int64(row, 3)), data,
                     static_cast<std::size_t>(sqlite3_column_bytes(row, 1))});
             });
  }

  std::vector<std::string> warnings() const override {
    return warning_.empty() ? std::vector<std::string>() : std::vector<std::string>{warning_};
  }

 private:
  /// A message that is whole, as far as a file without check sums shows.
  struct Row {
    std::int64_t time, id;
    std::string topic;
    std::size_t size;  // bytes
  };

  /// What is missing at the end of the file; empty: nothing. SQLite reads zeros there. Its header has the
  /// size of a page in bytes 16 and 17 (1 means 65536) and their number in bytes 28 to 31
  /// (sqlite.org/fileformat2.html), big endian.
  static std::string cut_of(const std::string& path, std::size_t& page) {
    std::ifstream in = open_input(path);  // its errors name the reason
    std::string head(100, '\0');
    in.read(head.data(), static_cast<std::streamsize>(head.size()));
    if (in.gcount() != 100 || head.compare(0, 15, "SQLite format 3") != 0)
      throw BadData(path, "no SQLite file");
    const auto byte = [&head](std::size_t i) { return std::uint64_t{static_cast<std::uint8_t>(head[i])}; };
    const std::uint64_t stated = byte(16) << 8 | byte(17);
    page = stated == 1 ? 65536 : stated;
    const std::uint64_t count = byte(28) << 24 | byte(29) << 16 | byte(30) << 8 | byte(31);
    in.seekg(0, std::ios::end);
    const auto size = static_cast<std::uint64_t>(std::max<std::streamoff>(0, in.tellg()));
    std::error_code error;
    if (std::filesystem::exists(path + "-wal", error) || size >= page * count) return "";
    return fmt::format("the file was cut off: {} bytes of {} are there", size, page * count);
  }

  std::string damage_of_pages() {
    std::string problem;
    try {
      each_row("PRAGMA quick_check(1)", [&](sqlite3_stmt* row) { problem = text(row, 0); });
    } catch (const BadData&) {
      problem = sqlite3_errmsg(database_);
    }
    return problem == "ok" ? "" : "damaged: " + printable(problem, 200);
  }

  /// With a writable schema, of a file that is opened for reading only, SQLite takes the pages that are there
  /// (sqlite.org/pragma.html#pragma_writable_schema, "corrupt").
  void take_as_it_is() {
    sqlite3_db_config(database_, SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr);
    each_row("PRAGMA writable_schema=ON", [](sqlite3_stmt*) {});
    each_row("PRAGMA cell_size_check=ON", [](sqlite3_stmt*) {});
  }

  /// The messages before the damage, as they stand in the file: without the index of their times, which may
  /// be damaged too. What no recorder writes is damage, too; and the message before it may be a part of one,
  /// as nothing has a check sum.
  std::vector<Row> rows_before_damage(const std::vector<std::string>& topics) {
    std::map<std::int64_t, std::string> known;
    each_row(kTopics, [&](sqlite3_stmt* row) { known.emplace(sqlite3_column_int64(row, 0), text(row, 1)); });
    std::vector<Row> rows;
    bool whole = true;
    try {
      std::int64_t last = std::numeric_limits<std::int64_t>::min();
      each_row("SELECT topic_id, data, rowid, timestamp FROM messages NOT INDEXED ORDER BY rowid",
               [&](sqlite3_stmt* row) {
                 const auto topic = known.find(sqlite3_column_int64(row, 0));
                 const std::int64_t id = sqlite3_column_int64(row, 2), time = sqlite3_column_int64(row, 3);
                 if (topic == known.end() || sqlite3_column_type(row, 0) != SQLITE_INTEGER ||
                     sqlite3_column_type(row, 1) != SQLITE_BLOB || !sqlite3_column_blob(row, 1) ||
                     sqlite3_column_type(row, 3) != SQLITE_INTEGER || id <= last || time < 0)
                   fail();
                 last = id;
                 rows.push_back({time, id, topic->second, std::size_t(sqlite3_column_bytes(row, 1))});
               });
    } catch (const BadData&) {
      whole = false;
    }
    for (std::size_t left_out = 0; !whole && !rows.empty() && left_out < page_; rows.pop_back())
      left_out += rows.back().size;
    warning_ = path_ + ": " + damage_ + "; " +
               (whole ? fmt::format("its {} messages were read", rows.size())
                      : fmt::format("{} messages were read, nothing behind them", rows.size()));
    rows.erase(std::remove_if(rows.begin(), rows.end(),
                              [&](const Row& row) {
                                return std::find(topics.begin(), topics.end(), row.topic) == topics.end();
                              }),
               rows.end());
    std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
      return std::make_pair(a.time, a.id) < std::make_pair(b.time, b.id);
    });
    return rows;
  }

  void read_to_damage(const std::vector<std::string>& topics, const Take& take) {
    for (const Row& wanted : rows_before_damage(topics))
      each_row(fmt::format("SELECT data FROM messages NOT INDEXED WHERE rowid = {}", wanted.id),
               [&](sqlite3_stmt* row) {
                 const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(row, 0));
                 take({wanted.topic, static_cast<std::uint64_t>(wanted.time), data,
                       static_cast<std::size_t>(sqlite3_column_bytes(row, 0))});
               });
  }

  /// Views in their place could run anything.
  void check_tables() {
    int found = 0;
    each_row("SELECT 1 FROM sqlite_master WHERE type='table' AND name IN ('topics','messages')",
             [&](sqlite3_stmt*) { ++found; });
    if (found != 2) throw BadData(path_, "no recording of rosbag2: it has no tables 'topics' and 'messages'");
  }

  template <typename Action>
  void each_row(const std::string& query, const Action& action) {
    sqlite3_stmt* raw = nullptr;
    if (sqlite3_prepare_v2(database_, query.c_str(), -1, &raw, nullptr) != SQLITE_OK) fail();
    const std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)> statement(raw, sqlite3_finalize);
    for (;;) {
      const int code = sqlite3_step(raw);
      if (code == SQLITE_DONE) return;
      if (code != SQLITE_ROW) fail();
      action(raw);
    }
  }

  static std::string text(sqlite3_stmt* row, int column) {
    const auto* value = sqlite3_column_text(row, column);
    return value ? reinterpret_cast<const char*>(value) : "";
  }

  [[noreturn]] void fail() const {
    throw BadData(path_, "damaged or no SQLite file: " + printable(sqlite3_errmsg(database_), 200));
  }

  const std::string path_;
  std::size_t page_ = 0;  // bytes
  std::string damage_;    // what is wrong with the file; empty: nothing
  std::string warning_;   // of the last read
  sqlite3* database_ = nullptr;
};

}  // namespace

std::unique_ptr<Recording> open_sqlite(const std::string& path) {
  return std::make_unique<Sqlite>(path);
}

}  // namespace backlash::recording
