// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "backlash_diagnosis/base/error.h"
#include "report/html_template.h"

namespace backlash::report {
namespace {

TEST(HtmlTemplate, TextIsEscapedUnlessItIsHtml) {
  const Json data = {{"text", "a < b & \"c\" > d"}, {"count", 3}};
  EXPECT_EQ(filled("<p>{{text}}</p>{{{text}}}{{count}}", data),
            "<p>a &lt; b &amp; &quot;c&quot; &gt; d</p>a < b & \"c\" > d3");
}

TEST(HtmlTemplate, SectionsAreThereForEachItemForAValueOrNot) {
  const std::string text = "{{#list}}{{name}}{{^last}}, {{/last}}{{/list}}{{^list}}none{{/list}}";
  EXPECT_EQ(filled(text, {{"list", {{{"name", "a"}, {"last", false}}, {{"name", "b"}, {"last", true}}}}}),
            "a, b");
  EXPECT_EQ(filled(text, {{"list", Json::array()}}), "none");
  EXPECT_EQ(filled(text, Json::object()), "none");
  EXPECT_EQ(filled("{{#words}}[{{.}}]{{/words}}", {{"words", {"x", "<"}}}), "[x][&lt;]");
  EXPECT_EQ(
      filled("{{#a}}<{{a}}>{{/a}}{{#b}}no{{/b}}{{#c}}no{{/c}}", {{"a", "1"}, {"b", ""}, {"c", nullptr}}),
      "<1>");
  EXPECT_EQ(filled("{{#zero}}0 is a value{{/zero}}", {{"zero", 0}}), "0 is a value");
}

TEST(HtmlTemplate, NamesAreThoseOfTheInnermostSectionFirst) {
  const Json data = {{"name", "outer"}, {"part", {{"name", "inner"}}}, {"other", {{"x", 1}}}};
  EXPECT_EQ(filled("{{#part}}{{name}}{{/part}} {{#other}}{{name}}{{/other}}", data), "inner outer");
}

TEST(HtmlTemplate, LinesOfSectionTagsAreNotInThePage) {
  EXPECT_EQ(filled("a\n{{#list}}\n<{{.}}>\n{{/list}}\nb\n", {{"list", {1, 2}}}), "a\n<1>\n<2>\nb\n");
  EXPECT_EQ(filled("a\n{{#list}}\n<{{.}}>\n{{/list}}\nb\n", Json::object()), "a\nb\n");
}

TEST(HtmlTemplate, WhatIsMissingIsAnError) {
  for (const char* text : {"{{absent}}", "{{#open}}", "{{open", "{{}}"})
    EXPECT_THROW(filled(text, {{"open", true}}), Error) << text;
}

}  // namespace
}  // namespace backlash::report
