# cmake -DOUTPUT=... -DSTYLE=... -DHTML=... "-DSCRIPTS=a.js;b.js" -DMAP_HTML=... "-DMAP_SCRIPTS=..."
#   -P embed_page.cmake
# Writes a C++ file with the content of the files. Scripts are joined in their order.
function(embed name content)
  string(HEX "${content}" digits)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${digits}")
  # Lines of a bounded length.
  string(REGEX REPLACE "((0x..,)(0x..,)(0x..,)(0x..,)(0x..,)(0x..,)(0x..,)(0x..,))" "\\1\n" bytes
    "${bytes}")
  set(text "${text}constexpr unsigned char ${name}_bytes[] = {\n${bytes}0};\n" PARENT_SCOPE)
endfunction()

foreach(list SCRIPTS MAP_SCRIPTS)
  set(joined_${list} "")
  foreach(file IN LISTS ${list})
    file(READ ${file} part)
    string(APPEND joined_${list} "${part}")
  endforeach()
endforeach()
file(READ ${HTML} html)
file(READ ${MAP_HTML} map_html)
file(READ ${STYLE} style)

set(text "")
embed(html "${html}")
embed(style "${style}")
embed(script "${joined_SCRIPTS}")
embed(map_html "${map_html}")
embed(map_script "${joined_MAP_SCRIPTS}")
set(file "#include \"viewer/page_files.hpp\"\n\nnamespace dynains::viewer {\nnamespace {\n\n${text}
template <std::size_t kSize>
std::string_view text_of(const unsigned char (&bytes)[kSize]) {
  return {reinterpret_cast<const char*>(bytes), kSize - 1};
}

}  // namespace

const std::string_view kPageHtml = text_of(html_bytes);
const std::string_view kPageStyle = text_of(style_bytes);
const std::string_view kPageScript = text_of(script_bytes);
const std::string_view kMapPageHtml = text_of(map_html_bytes);
const std::string_view kMapPageScript = text_of(map_script_bytes);

}  // namespace dynains::viewer\n")
file(WRITE ${OUTPUT} "${file}")
