// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <climits>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/base/yaml_problems.h"
#include "backlash_diagnosis/base/yaml_reader.h"

namespace backlash {
namespace {

namespace fs = std::filesystem;

YamlReader parse(const std::string& text) {
  return YamlReader::from_text(text, "rig.yaml");
}

// The message of the BadData that `action` throws; any other exception fails the test by itself.
std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const BadData& error) {
    return error.what();
  }
  return "nothing thrown";
}

const char* const kRig =
    "# a rig\n"
    "name: 12\n"
    "motor:\n"
    "  inertia: 1.5e-4\n"
    "  poles: +8\n"
    "  rigid: true\n"
    "law: linear\n"
    "gains: [1, -2.5, +3]\n"
    "labels: [a, 'b c', 3]\n"
    "terms:\n"
    "  - {id: coulomb, value: 0.1}\n"
    "  - id: viscous\n"
    "    value: 0.2\n";

TEST(YamlReader, ReadsEveryType) {
  const YamlReader rig = parse(kRig);
  EXPECT_EQ(rig.source(), "rig.yaml");
  EXPECT_EQ(rig.text("name"), "12");
  const YamlReader motor = rig.map("motor");
  EXPECT_EQ(motor.number("inertia", Range::positive()), 1.5e-4);
  EXPECT_EQ(motor.integer("poles", 1, 100), 8);
  EXPECT_TRUE(motor.boolean("rigid"));
  EXPECT_EQ(rig.choice("law", {"power", "linear"}), "linear");
  EXPECT_EQ(rig.numbers("gains", Range::any()), (std::vector<double>{1, -2.5, 3}));
  EXPECT_EQ(rig.texts("labels"), (std::vector<std::string>{"a", "b c", "3"}));
  const std::vector<YamlReader> terms = rig.maps("terms");
  ASSERT_EQ(terms.size(), 2u);
  EXPECT_EQ(terms[0].text("id"), "coulomb");
  EXPECT_EQ(terms[0].number("value", Range::any()), 0.1);
  EXPECT_EQ(terms[1].text("id"), "viscous");
  EXPECT_EQ(terms[1].number("value", Range::any()), 0.2);
  EXPECT_NO_THROW(rig.finish());
}

TEST(YamlReader, AbsentKeysTakeTheirDocumentedMeaningAndPresentOnesDoNot) {
  const YamlReader rig = parse("a: 1\nb: false\nc: x\nd: 7\n");
  EXPECT_EQ(rig.number_or("none", 2.5, Range::positive()), 2.5);
  EXPECT_EQ(rig.integer_or("none", 3, 0, 9), 3);
  EXPECT_TRUE(rig.boolean_or("none", true));
  EXPECT_EQ(rig.text_or("none", "absent"), "absent");
  EXPECT_FALSE(rig.optional_map("none").has_value());
  EXPECT_EQ(rig.number_or("a", 2.5, Range::positive()), 1);
  EXPECT_FALSE(rig.boolean_or("b", true));
  EXPECT_EQ(rig.text_or("c", "absent"), "x");
  EXPECT_EQ(rig.integer_or("d", 3, 0, 9), 7);
  EXPECT_EQ(message_of([&] { rig.number_or("b", 2.5, Range::positive()); }),
            "rig.yaml:2: b = false: not a number, must be > 0");
}

TEST(YamlReader, HasAndIsText) {
  const YamlReader rig = parse("a: 1\nb: {c: 2}\nd: [1]\ne: 'q'\nf:\n");
  EXPECT_TRUE(rig.has("a"));
  EXPECT_TRUE(rig.has("f"));
  EXPECT_FALSE(rig.has("z"));
  EXPECT_TRUE(rig.is_text("a"));
  EXPECT_TRUE(rig.is_text("e"));
  EXPECT_FALSE(rig.is_text("b"));
  EXPECT_FALSE(rig.is_text("d"));
  EXPECT_FALSE(rig.is_text("f"));
  EXPECT_FALSE(rig.is_text("z"));
}

TEST(YamlReader, AcceptsByteOrderMarkCarriageReturnsAndMissingFinalLineEnd) {
  const YamlReader rig = parse(
      "\xef\xbb\xbf"
      "a: 1\r\nb:\r\n  c: text\r\nd: bad");
  EXPECT_EQ(rig.number("a", Range::any()), 1);
  EXPECT_EQ(rig.map("b").text("c"), "text");
  EXPECT_EQ(message_of([&] { rig.boolean("d"); }), "rig.yaml:4: d = bad: must be true or false");
}

TEST(YamlReader, QuotedTextStaysText) {
  const YamlReader rig = parse("empty: ''\nnull_text: 'null'\nutf: \"\\u00b5m\"\n");
  EXPECT_EQ(rig.text("empty"), "");
  EXPECT_EQ(rig.text("null_text"), "null");
  EXPECT_EQ(rig.text("utf"), "\xc2\xb5m");
}

struct BadValue {
  const char* text;
  std::function<void(const YamlReader&)> read;
  const char* message;
};

TEST(YamlReader, WrongValuesNameFileLineKeyValueAndLimit) {
  const auto number = [](const YamlReader& r) { r.number("k", Range::any()); };
  const auto positive = [](const YamlReader& r) { r.map("m").number("k", Range::positive()); };
  const auto integer = [](const YamlReader& r) { r.integer("k", 0, 9); };
  const auto boolean = [](const YamlReader& r) { r.boolean("k"); };
  const auto text = [](const YamlReader& r) { r.text("k"); };
  const auto numbers = [](const YamlReader& r) { r.numbers("k", Range::not_negative()); };
  const auto texts = [](const YamlReader& r) { r.texts("k"); };
  const auto choice = [](const YamlReader& r) { r.choice("k", {"a", "b"}); };
  const auto map = [](const YamlReader& r) { r.map("k"); };
  const auto maps = [](const YamlReader& r) { r.maps("k"); };
  const BadValue cases[] = {
      {"\nm:\n  k: -1\n", positive, "rig.yaml:3: m.k = -1: must be > 0"},
      {"m:\n  k: 0\n", positive, "rig.yaml:2: m.k = 0: must be > 0"},
      {"m:\n  j: 0\n", positive, "rig.yaml:1: m.k: is missing, expected a number"},
      {"a: 1\nm: 5\n", positive, "rig.yaml:2: m = 5: must be a map"},
      {"a: 1\n", positive, "rig.yaml:1: m: is missing, expected a map"},
      {"k: .nan\n", number, "rig.yaml:1: k = .nan: not a finite number"},
      {"k: -.inf\n", number, "rig.yaml:1: k = -.inf: not a finite number"},
      {"k: nan\n", number, "rig.yaml:1: k = nan: not a finite number"},
      {"k: 1e999\n", number, "rig.yaml:1: k = 1e999: too large or too small for a double"},
      {"k: 10 mm\n", number, "rig.yaml:1: k = 10 mm: not a number"},
      {"k: 0x1F\n", number, "rig.yaml:1: k = 0x1F: not a number"},
      {"k: '1.5'\n", number, "rig.yaml:1: k = '1.5': is text in quotes, expected a number"},
      {"k:\n", number, "rig.yaml:1: k = null: has no value, expected a number"},
      {"k: ~\n", number, "rig.yaml:1: k = null: has no value, expected a number"},
      {"k: [1]\n", number, "rig.yaml:1: k = [...]: is a list, expected a number"},
      {"k:\n  x: 1\n", number, "rig.yaml:1: k = {...}: is a map, expected a number"},
      {"k: 1.5\n", integer, "rig.yaml:1: k = 1.5: must be an integer >= 0 and <= 9"},
      {"k: 1e3\n", integer, "rig.yaml:1: k = 1e3: must be an integer >= 0 and <= 9"},
      {"k: +-1\n", integer, "rig.yaml:1: k = +-1: must be an integer >= 0 and <= 9"},
      {"k: 10\n", integer, "rig.yaml:1: k = 10: must be >= 0 and <= 9"},
      {"k: -1\n", integer, "rig.yaml:1: k = -1: must be >= 0 and <= 9"},
      {"k: 99999999999999999999\n", integer, "rig.yaml:1: k = 99999999999999999999: must be >= 0 and <= 9"},
      {"k: '3'\n", integer, "rig.yaml:1: k = '3': is text in quotes, expected an integer"},
      {"k: yes\n", boolean, "rig.yaml:1: k = yes: must be true or false"},
      {"k: True\n", boolean, "rig.yaml:1: k = True: must be true or false"},
      {"k: 1\n", boolean, "rig.yaml:1: k = 1: must be true or false"},
      {"k: 'true'\n", boolean, "rig.yaml:1: k = 'true': is text in quotes, expected true or false"},
      {"k:\n", text, "rig.yaml:1: k = null: has no value, expected text"},
      {"k: {a: 1}\n", text, "rig.yaml:1: k = {...}: is a map, expected text"},
      {"k: [1, 2, x]\n", numbers, "rig.yaml:1: k[2] = x: not a number, must be >= 0"},
      {"k:\n  - 1\n  - -2\n", numbers, "rig.yaml:3: k[1] = -2: must be >= 0"},
      {"k: 5\n", numbers, "rig.yaml:1: k = 5: must be a list of numbers"},
      {"k: {a: 1}\n", numbers, "rig.yaml:1: k = {...}: must be a list of numbers"},
      {"k: [[1]]\n", numbers, "rig.yaml:1: k[0] = [...]: is a list, expected a number"},
      {"k: [a, [b]]\n", texts, "rig.yaml:1: k[1] = [...]: is a list, expected text"},
      {"k: a\n", texts, "rig.yaml:1: k = a: must be a list of texts"},
      {"k: c\n", choice, "rig.yaml:1: k = c: must be one of a, b"},
      {"k: [a]\n", choice, "rig.yaml:1: k = [...]: must be one of a, b"},
      {"j: a\n", choice, "rig.yaml:1: k: is missing, expected one of a, b"},
      {"k: [1]\n", map, "rig.yaml:1: k = [...]: must be a map"},
      {"k:\n", map, "rig.yaml:1: k = null: must be a map"},
      {"k:\n  - {a: 1}\n  - 3\n", maps, "rig.yaml:3: k[1] = 3: must be a map"},
      {"k: {a: 1}\n", maps, "rig.yaml:1: k = {...}: must be a list of maps"},
  };
  for (const BadValue& c : cases) {
    const YamlReader reader = parse(c.text);
    EXPECT_EQ(message_of([&] { c.read(reader); }), c.message) << c.text;
  }
}

TEST(YamlReader, IntegersCoverTheWholeRangeOfLong) {
  const YamlReader rig =
      parse("min: -9223372036854775808\nmax: 9223372036854775807\nover: 9223372036854775808\n");
  EXPECT_EQ(rig.integer("min", LONG_MIN, LONG_MAX), LONG_MIN);
  EXPECT_EQ(rig.integer("max", LONG_MIN, LONG_MAX), LONG_MAX);
  EXPECT_THROW(rig.integer("over", LONG_MIN, LONG_MAX), BadData);
}

TEST(YamlReader, LongValuesAreCutAndControlCharactersEscapedInMessages) {
  const YamlReader rig = parse("a: " + std::string(5000, 'x') + "\nb: \"\\e[31m\"\n");
  EXPECT_EQ(message_of([&] { rig.number("a", Range::any()); }),
            "rig.yaml:1: a = " + std::string(60, 'x') + "...: not a number");
  EXPECT_EQ(message_of([&] { rig.choice("b", {"c"}); }), "rig.yaml:2: b = '\\x1b[31m': must be one of c");
}

TEST(YamlReader, FailNamesTheValueOrTheMapWhereItIsMissing) {
  const YamlReader rig = parse("a: 1\nm:\n  half_gap: 2\n");
  EXPECT_EQ(message_of([&] { rig.map("m").fail("half_gap", "backlash is given too"); }),
            "rig.yaml:3: m.half_gap = 2: backlash is given too");
  EXPECT_EQ(message_of([&] { rig.map("m").fail("backlash", "needed with half_gap"); }),
            "rig.yaml:2: m.backlash: needed with half_gap");
}

TEST(YamlReader, FinishNamesTheFirstUnknownKeyAndListsTheKnown) {
  const YamlReader rig = parse("zeta: 1\nalpha: 2\nknown: 3\nbeta: 4\n");
  rig.number("known", Range::any());
  rig.number_or("optional", 1, Range::any());
  rig.ignore("alpha");
  EXPECT_EQ(message_of([&] { rig.finish(); }),
            "rig.yaml:1: zeta = 1: unknown key, known here: alpha, known, optional");
  rig.has("zeta");
  EXPECT_EQ(message_of([&] { rig.finish(); }),
            "rig.yaml:4: beta = 4: unknown key, known here: alpha, known, optional, zeta");
  rig.ignore("beta");
  EXPECT_NO_THROW(rig.finish());
}

TEST(YamlReader, FinishLooksIntoTheMapsThatWereRead) {
  const YamlReader rig =
      parse("motor:\n  inertia: 1\n  intertia: 2\nterms:\n  - id: a\n  - id: b\n    typo: 1\n");
  rig.map("motor").number("inertia", Range::any());
  for (const YamlReader& term : rig.maps("terms")) term.text("id");
  EXPECT_EQ(message_of([&] { rig.finish(); }),
            "rig.yaml:3: motor.intertia = 2: unknown key, known here: inertia");
  rig.map("motor").ignore("intertia");  // a second reader of the same map remembers with the first
  EXPECT_EQ(message_of([&] { rig.finish(); }), "rig.yaml:7: terms[1].typo = 1: unknown key, known here: id");
  rig.maps("terms")[1].ignore("typo");
  EXPECT_NO_THROW(rig.finish());
}

TEST(YamlReader, AllMistakesAtOnceWhereTheyAreCollected) {
  const auto read = [] {
    const YamlReader yaml = YamlReader::from_text("a: 1\nb: x\nc: {d: -1, e: 2}\nf: [1, y]\n", "f.yaml");
    EXPECT_EQ(yaml.number("a", Range::positive()), 1);
    EXPECT_TRUE(Range::between(2, 3).contains(yaml.number("b", Range::between(2, 3))));
    const YamlReader map = yaml.map("c");
    EXPECT_GT(map.number("d", Range::positive()), 0);
    yaml.numbers("f", Range::any());
    yaml.map("g").map("h").number("i", Range::any());  // of what is missing nothing else is
    yaml.finish();
  };
  YamlProblems problems;
  problems.reading(read);
  try {
    problems.raise("f.yaml");
    FAIL();
  } catch (const BadData& error) {
    EXPECT_STREQ(
        error.what(),
        "f.yaml: 5 mistakes\n  f.yaml:2: b = x: not a number, must be >= 2 and <= 3\n"
        "  f.yaml:3: c.d = -1: must be > 0\n  f.yaml:4: f[1] = y: not a number\n"
        "  f.yaml:1: g: is missing, expected a map\n  f.yaml:3: c.e = 2: unknown key, known here: d");
  }
  {
    YamlProblems none;
    none.raise("f.yaml");
    EXPECT_EQ(YamlProblems::current(), &none);
  }
  EXPECT_EQ(YamlProblems::current(), &problems);
}

TEST(YamlReader, CopiesRememberTogetherAndOutliveTheFirst) {
  auto first = std::make_unique<YamlReader>(parse("a: 1\nm: {b: 2}\n"));
  const YamlReader copy = *first;
  first->number("a", Range::any());
  const YamlReader child = first->map("m");
  first.reset();
  EXPECT_EQ(child.number("b", Range::any()), 2);
  EXPECT_NO_THROW(copy.finish());
}

TEST(YamlReader, AliasesAreReadPerPlace) {
  const YamlReader rig = parse("a: &x {k: 1}\nb: *x\n");
  EXPECT_EQ(rig.map("a").number("k", Range::any()), 1);
  const YamlReader b = rig.map("b");
  EXPECT_EQ(message_of([&] { rig.finish(); }), "rig.yaml:1: b.k = 1: unknown key, known here: none");
  EXPECT_EQ(b.number("k", Range::any()), 1);
  EXPECT_NO_THROW(rig.finish());
}

TEST(YamlReader, DocumentsThatAreNotOnePlainMapAreRefused) {
  const struct {
    std::string text, message;
  } cases[] = {
      {"", "rig.yaml:1: empty, expected a map of keys and values"},
      {"# only a comment\n", "rig.yaml:1: empty, expected a map of keys and values"},
      {"---\n", "rig.yaml:1: empty, expected a map of keys and values"},
      {"just text\n", "rig.yaml:1: not a map of keys and values"},
      {"\n- 1\n- 2\n", "rig.yaml:2: not a map of keys and values"},
      {"a: 1\n---\nb: 2\n", "rig.yaml:3: a second document, expected one"},
      {"a: 1\nb: 2\na: 3\n", "rig.yaml:3: key 'a': there twice, first in line 1"},
      {"m:\n  a: 1\n  'a': 3\n", "rig.yaml:3: key 'a': there twice, first in line 2"},
      {"m: {a: 1, a: 1}\n", "rig.yaml:1: key 'a': there twice"},
      {"a: &x [1, *x]\n", "rig.yaml:1: an alias to a list or map that it is itself part of"},
      {"a: &x\n  b:\n    c: *x\n", "rig.yaml:3: an alias to a list or map that it is itself part of"},
      {"a: *none\n", "rig.yaml:1: not valid YAML: "},
      {"a: 1\n? [b]\n: 2\n", "rig.yaml:2: a list or map as key"},
      {"k: &x 1\n*x : 2\n", "rig.yaml:2: an alias as key"},
      {": 1\n", "rig.yaml:1: an empty key"},
      {"a: !!python/object:os.system x\n", "rig.yaml:1: tag 'tag:yaml.org,2002:python/object:os.system'"},
      {"a: 1\nb: [1, 2\n", "not valid YAML: "},
      {"a: 1\n\tb: 2\n", "not valid YAML: "},
      {"a: 'open\n", "not valid YAML: a quote that never closes"},
      {"a: \"open", "not valid YAML: a quote that never closes"},
      {"a: 1\nb: 'it''s", "not valid YAML: a quote that never closes"},
      {"a: [1, 2", "not valid YAML: "},
      {"a: {b: 2", "not valid YAML: "},
      {"a: b: c\n", "rig.yaml:1: not valid YAML: "},
      {"a: 1\n]\n", "rig.yaml:2: "},
      {"%YAML 9.9\n---\na: 1\n", "not valid YAML: "},
      {std::string("a: 1\nb: \0\n", 10), "rig.yaml:2: contains the control character \\x00"},
      {"\x7f"
       "ELF\x02\x01\x01",
       "rig.yaml:1: contains the control character \\x7f"},
      {"a: 1\nb: \x1b[0m\n", "rig.yaml:2: contains the control character \\x1b"},
      {std::string("\xff\xfe"
                   "a\0:\0",
                   6),
       "rig.yaml:1: contains the control character \\x00"},
  };
  for (const auto& c : cases) {
    const std::string message = message_of([&] { parse(c.text); });
    EXPECT_EQ(message.rfind("rig.yaml:", 0), 0u) << c.text << " -> " << message;
    EXPECT_NE(message.find(c.message), std::string::npos) << c.text << " -> " << message;
  }
}

std::string repeated(const std::string& part, std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += part;
  return text;
}

TEST(YamlReader, DeepNestingIsRefusedBeforeItOverflowsTheStack) {
  const char* const pairs[][2] = {{"[", "]"}, {"{a: ", "}"}, {"[{a: ", "}]"}, {"- ", ""}};
  for (const std::size_t depth :
       {std::size_t{64}, std::size_t{200}, std::size_t{2000}, std::size_t{500000}}) {
    for (const auto& pair : pairs) {
      const std::string opened = "a:\n " + repeated(pair[0], depth);
      EXPECT_NE(message_of([&] {
                  parse(opened + "1" + repeated(pair[1], depth));
                }).find("nested deeper than 64 levels"),
                std::string::npos)
          << depth << pair[0];
      EXPECT_THROW(parse(opened), BadData) << depth << pair[0];
      EXPECT_THROW(parse(opened + repeated(pair[1], depth) + ": 1"), BadData) << depth << pair[0];
    }
  }
  std::string indented;
  for (std::size_t i = 0; i < 100; ++i) indented += std::string(i, ' ') + "a:\n";
  EXPECT_EQ(message_of([&] { parse(indented); }), "rig.yaml:65: nested deeper than 64 levels");
}

TEST(YamlReader, NestingUpToTheLimitIsRead) {
  // The top map is the first level, so 63 lists fit below it.
  EXPECT_NO_THROW(parse("a: " + repeated("[", 63) + "1" + repeated("]", 63)));
  EXPECT_THROW(parse("a: " + repeated("[", 64) + "1" + repeated("]", 64)), BadData);
}

TEST(YamlReader, AliasesThatMultiplyStaySmall) {
  std::string text = "a0: &a0 [1, 1]\n";
  for (int i = 1; i <= 5000; ++i) {
    const std::string previous = "*a" + std::to_string(i - 1) + " ";
    text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + previous + ", " + previous + "]\n";
  }
  const YamlReader rig = parse(text);
  EXPECT_EQ(rig.numbers("a0", Range::any()).size(), 2u);
  EXPECT_EQ(message_of([&] { rig.numbers("a1", Range::any()); }),
            "rig.yaml:1: a1[0] = [...]: is a list, expected a number");
}

TEST(YamlReader, HugeTextsAreRefused) {
  EXPECT_EQ(message_of([] { parse("a: " + std::string(5 << 20, 'x')); }),
            "rig.yaml: larger than 4194304 bytes, too large for a configuration");
}

// Whatever the bytes are: a reader or a BadData, nothing else.
TEST(YamlReader, RandomDocumentsEndInAReaderOrBadData) {
  Random random(20240501);
  const std::string alphabet = "ab1:-?,[]{}&*!|>'\"%@`#~ \n\n\t\r.<\\";
  const std::string source = kRig;
  int read = 0, refused = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string text = i % 2 == 0 ? source : std::string(random.below(60), ' ');
    const std::size_t changes = i % 2 == 0 ? 1 + random.below(4) : text.size();
    for (std::size_t k = 0; k < changes; ++k) {
      const char c = random.below(8) == 0 ? static_cast<char>(random.below(256))
                                          : alphabet[random.below(alphabet.size())];
      if (!text.empty()) text[i % 2 == 0 ? random.below(text.size()) : k] = c;
    }
    try {
      const YamlReader reader = parse(text);
      reader.has("name");
      ++read;
      reader.finish();
    } catch (const BadData& error) {
      EXPECT_EQ(std::string(error.what()).rfind("rig.yaml:", 0), 0u) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(read, 1000);  // both branches are met; the exact shares follow from the seed
  EXPECT_GT(refused, 1000);
}

TEST(YamlReader, FilesAreReadAndMissingOnesNamed) {
  std::string folder = (fs::temp_directory_path() / "backlash_yaml_XXXXXX").string();
  ASSERT_NE(::mkdtemp(folder.data()), nullptr);
  const std::string path = folder + "/rig.yaml";
  std::ofstream(path) << "a: x\n";
  const YamlReader rig = YamlReader::from_file(path);
  EXPECT_EQ(rig.source(), path);
  EXPECT_EQ(message_of([&] { rig.number("a", Range::any()); }), path + ":1: a = x: not a number");
  EXPECT_THROW(YamlReader::from_file(folder), MissingInput);
  EXPECT_THROW(YamlReader::from_file(folder + "/none.yaml"), MissingInput);
  std::ofstream(path, std::ios::trunc).close();
  EXPECT_THROW(YamlReader::from_file(path), BadData);
  fs::remove_all(folder);
}

TEST(YamlReader, EndlessDevicesAreRefused) {
  if (!fs::is_character_file("/dev/zero")) GTEST_SKIP() << "no /dev/zero";
  EXPECT_THROW(YamlReader::from_file("/dev/zero"), BadData);
}

TEST(YamlReader, KeysComeInTheOrderOfTheFileAndStayUnknown) {
  const YamlReader yaml = YamlReader::from_text("walk: 1\nalone: 2\nhand: 3\n", "t");
  EXPECT_EQ(yaml.keys(), (std::vector<std::string>{"walk", "alone", "hand"}));
  EXPECT_THROW(yaml.finish(), BadData);
}

}  // namespace
}  // namespace backlash
