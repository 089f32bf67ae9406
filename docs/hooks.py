"""For mkdocs: the site has the documents of the whole repository under the paths that they have there, so that one
relative link, to a page, a picture or a source file, works in both."""

from __future__ import annotations

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

SHOWN = (
    "*.md",
    "LICENSE",
    "docs/*.md",
    "docs/*.css",
    "docs/gallery/*",
    "spec/*.md",
    "spec/gltf/README.md",
    "spec/media-type/*",
    "spec/gltf/schema/*.json",
    "bench/results/*.png",
    "bench/results/*.svg",
    "bench/results/*.webp",
    "athcodec/sample/*.ath",
    "athcodec/viewer/web/*",
    "athcodec/viewer/*.d.ts",
    "athcodec/viewer/ath_decoder.mjs",
    "athcodec/viewer/examples/*",
    "athcodec/viewer/src/*.d.ts",
    "athcodec/exporters/vat.md",
    "athcodec/usd/*.md",
    "athcodec/gpu/*.wgsl",
    "athcodec/gpu/*.mjs",
    "athcodec/gpu/*.py",
    "athcodec/core/include/ath.h",
    "athcodec/core/include/ath_gpu.h",
    "athcodec/core/include/ath_player.h",
    "athcodec/core/examples/*",
    "athcodec/core/bindings/*",
    "tests/points_plugin/pyproject.toml",
    "tests/points_plugin/athcodec_points/*.py",
)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    root = Path(config.config_file_path).parent
    of_theme = [file for file in files if file.src_dir != config.docs_dir]
    shown = sorted({path for pattern in SHOWN for path in root.glob(pattern)})
    return Files(
        [
            *of_theme,
            *(File.generated(config, path.relative_to(root).as_posix(), abs_src_path=str(path)) for path in shown),
        ]
    )


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Addresses in HTML of the gallery from the place that the site gives the page, a folder of its own."""
    if page.file.src_uri != "docs/gallery.md":
        return markdown
    return re.sub(r'((?:src=|href=|floor=|: )"|(?<==\d) )(\.\./|gallery/)', r"\1../\2", markdown)
