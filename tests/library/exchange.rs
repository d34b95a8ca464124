//! Materials of other programs, against what their specifications say of numbers chosen here.

use lobes::Error;
use lobes::exchange::{Format, Imported, Loss, read, write};
use lobes::reflectance::{Material, presets};

fn close(got: [f64; 3], want: [f64; 3]) {
    for (got, want) in got.into_iter().zip(want) {
        assert!((got - want).abs() < 1e-12, "{got} for {want}");
    }
}

fn gltf(material: &str) -> Imported {
    let text = format!(r#"{{"asset": {{"version": "2.0"}}, "materials": [{material}]}}"#);
    read(Format::Gltf, &text).unwrap()
}

fn mitsuba(bsdf: &str) -> Imported {
    read(
        Format::Mitsuba,
        &format!("<scene version=\"3.0.0\">{bsdf}</scene>"),
    )
    .unwrap()
}

#[test]
fn gltf_as_its_appendix_b_has_it() {
    // mix(dielectric, metal, ¼): F₀ 0.04 of a dielectric, which leaves 0.96 to the body.
    let found = gltf(
        r#"{"name": "half", "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.4, 0.2, 1], "metallicFactor": 0.25, "roughnessFactor": 0.5}}"#,
    );
    let half = &found.materials[0];
    close(half.diffuse(), [0.8, 0.4, 0.2].map(|c| 0.75 * 0.96 * c));
    close(
        half.specular(),
        [0.8, 0.4, 0.2].map(|c| 0.75 * 0.04 + 0.25 * c),
    );
    assert_eq!(half.roughness().sigma(), 0.25);
    let losses: Vec<&Loss> = found.notes.iter().map(|note| &note.loss).collect();
    assert_eq!(losses, [&Loss::Fresnel, &Loss::Tail { alpha: 0.25 }]);
    // The defaults are a white metal of roughness 1.
    let white = &gltf("{}").materials[0];
    assert_eq!(white.name(), "material 1");
    close(white.specular(), [1.0; 3]);
    assert_eq!(white.roughness().sigma(), 1.0);
    // Water, tinted: F₀ = (0.33/2.33)² · tint · factor, and the body has what the largest channel
    // leaves.
    let water = &gltf(
        r#"{"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [0.5, 0.5, 0.5, 1]},
            "extensions": {"KHR_materials_ior": {"ior": 1.33}, "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 2, 3]}}}"#,
    )
    .materials[0];
    let f0 = (0.33f64 / 2.33).powi(2) * 0.5;
    close(water.specular(), [f0, 2.0 * f0, 3.0 * f0]);
    close(water.diffuse(), [0.5 * (1.0 - 3.0 * f0); 3]);
}

#[test]
fn what_gltf_has_more_is_noted() {
    let found = gltf(
        r#"{"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0, "roughnessFactor": 0},
            "normalTexture": {"index": 1}, "emissiveFactor": [0, 1, 0], "alphaMode": "BLEND", "extensions": {"KHR_materials_clearcoat": {}}}"#,
    );
    let left_out: Vec<&str> = found
        .notes
        .iter()
        .filter_map(|note| match &note.loss {
            Loss::LeftOut { what } => Some(what.as_str()),
            _ => None,
        })
        .collect();
    assert_eq!(
        left_out,
        [
            "baseColorTexture",
            "normalTexture",
            "emissiveFactor",
            "alphaMode",
            "KHR_materials_clearcoat"
        ]
    );
    assert_eq!(
        found.notes[0].to_string(),
        "\"wood\" is read without its baseColorTexture"
    );
}

#[test]
fn mitsuba_as_its_plugins_have_it() {
    let matte = &mitsuba(r#"<bsdf type="twosided" id="clay"><bsdf type="diffuse"><rgb name="reflectance" value="0.5, 0.3, 0.1"/></bsdf></bsdf>"#).materials[0];
    assert_eq!(matte.name(), "clay");
    close(matte.diffuse(), [0.5, 0.3, 0.1]);
    assert!(matte.is_matte());
    // #808080 in sRGB is 0.2158605 in linear light.
    let grey =
        &mitsuba(r##"<bsdf type="diffuse"><rgb name="reflectance" value="#808080"/></bsdf>"##)
            .materials[0];
    assert!((grey.diffuse()[0] - 0.215_860_5).abs() < 1e-7);
    // ((n − 1)² + k²)/((n + 1)² + k²).
    let metal = mitsuba(
        r#"<bsdf type="roughconductor"><float name="eta" value="0.5"/><spectrum name="k" value="2"/><string name="distribution" value="ggx"/><float name="alpha" value="0.3"/></bsdf>"#,
    );
    close(
        metal.materials[0].specular(),
        [(0.25 + 4.0) / (2.25 + 4.0); 3],
    );
    assert!(
        metal
            .notes
            .iter()
            .any(|note| note.loss == Loss::Tail { alpha: 0.3 })
    );
    // An index of 1.5 has F₀ = 0.04.
    let plastic = &mitsuba(r#"<bsdf type="roughplastic"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/><float name="alpha" value="0.2"/><rgb name="diffuse_reflectance" value="0.5"/></bsdf>"#).materials[0];
    close(plastic.diffuse(), [0.48; 3]);
    close(plastic.specular(), [0.04; 3]);
    assert_eq!(plastic.roughness().sigma(), 0.2);
    // A specular of 0.5 is F₀ = 0.04.
    let principled = &mitsuba(r#"<bsdf type="principled"><rgb name="base_color" value="0.6 0.4 0.2"/><float name="metallic" value="0.5"/><float name="roughness" value="0.4"/></bsdf>"#).materials[0];
    close(principled.diffuse(), [0.3, 0.2, 0.1]);
    close(principled.specular(), [0.32, 0.22, 0.12]);
    assert!((principled.roughness().sigma() - 0.16).abs() < 1e-15);
    let named = mitsuba(
        r#"<bsdf type="conductor" id="au"><string name="material" value="Au"/></bsdf><bsdf type="dielectric" id="glass"/>"#,
    );
    assert!(named.materials.is_empty());
    assert_eq!(
        named.notes[1].to_string(),
        "\"glass\" is not read: it is the plugin \"dielectric\""
    );
}

#[test]
fn radiance_as_its_primitives_have_it() {
    let found = read(
        Format::Radiance,
        "# paint\nvoid plastic blue\n0 0\n5 .1 .2 .6 .05 .03\nmap metal brass 0 0 5 0.8 0.6 0.3 0.9 0.1 # old\nvoid glass pane 0 0 3 .9 .9 .9\nblue sphere ball 0 0 4 0 0 0 1\nvoid alias b blue\n",
    )
    .unwrap();
    let [blue, brass] = found.materials.as_slice() else {
        panic!("{found:?}");
    };
    close(blue.diffuse(), [0.095, 0.19, 0.57]);
    close(blue.specular(), [0.05; 3]);
    close(brass.diffuse(), [0.08, 0.06, 0.03]);
    close(brass.specular(), [0.72, 0.54, 0.27]);
    assert_eq!(brass.roughness().sigma(), 0.1);
    let sentences: Vec<String> = found.notes.iter().map(ToString::to_string).collect();
    assert_eq!(
        sentences,
        [
            "\"brass\" is read without its modifier \"map\"",
            "\"pane\" is not read: it is Radiance's glass, where plastic and metal are read",
        ]
    );
}

#[test]
fn what_is_written_is_read_again() {
    let mut materials = presets();
    materials.push(
        Material::from_albedos("green on red", [0.5, 0.1, 0.1], [0.05, 0.3, 0.05], 0.2).unwrap(),
    );
    materials.push(Material::metal("half gold", [0.8, 0.6, 0.3], 0.5, 0.1).unwrap());
    for format in Format::ALL {
        let written = write(format, &materials).unwrap();
        let refused = |name: &str| {
            written
                .notes
                .iter()
                .any(|note| note.material == name && matches!(note.loss, Loss::NotWritten { .. }))
        };
        let expected: Vec<&Material> = materials.iter().filter(|m| !refused(m.name())).collect();
        // Radiance has no highlight of another colour than the body's or white.
        assert_eq!(
            refused("green on red"),
            format == Format::Radiance,
            "{format}"
        );
        assert_eq!(
            expected.len(),
            materials.len() - usize::from(format == Format::Radiance),
            "{format}: {:?}",
            written.notes
        );
        let found = read(format, &written.text).unwrap();
        assert_eq!(found.materials.len(), expected.len());
        for (got, want) in found.materials.iter().zip(expected) {
            close(got.diffuse(), want.diffuse());
            close(got.specular(), want.specular());
            if !want.is_matte() {
                let (got, want) = (got.roughness().sigma(), want.roughness().sigma());
                assert!((got - want).abs() < 1e-15, "{format}: {got} {want}");
            }
        }
    }
}

#[test]
fn says_what_is_wrong() {
    for (format, text, part) in [
        (Format::Gltf, "{", "not JSON"),
        (Format::Gltf, "{}", "not glTF 2"),
        (
            Format::Gltf,
            r#"{"asset": {"version": "2.0"}, "materials": 3}"#,
            "not a list",
        ),
        (
            Format::Gltf,
            r#"{"asset": {"version": "2.0"}, "materials": [{"pbrMetallicRoughness": {"roughnessFactor": 2}}]}"#,
            "roughnessFactor",
        ),
        (
            Format::Gltf,
            r#"{"asset": {"version": "2.0"}, "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, "a", 0, 1]}}]}"#,
            "baseColorFactor",
        ),
        (Format::Mitsuba, "<scene", "not XML"),
        (Format::Mitsuba, "<svg/>", "<svg>"),
        (
            Format::Mitsuba,
            r#"<scene><bsdf type="diffuse"><rgb name="reflectance" value="1.5"/></bsdf></scene>"#,
            "reflectance",
        ),
        (
            Format::Mitsuba,
            r#"<scene><bsdf type="diffuse"><texture name="reflectance" type="bitmap"/></bsdf></scene>"#,
            "textures",
        ),
        (
            Format::Mitsuba,
            r#"<scene><bsdf type="roughplastic"><float name="alpha" value="nan"/></bsdf></scene>"#,
            "alpha",
        ),
        (Format::Radiance, "void plastic", "ends within"),
        (Format::Radiance, "!xform a.rad", "command"),
        (
            Format::Radiance,
            "void plastic a 0 0 4 1 1 1 1",
            "has 4 numbers",
        ),
        (Format::Radiance, "void plastic a 0 0 5 1 1 1 1", "cut off"),
        (
            Format::Radiance,
            "void plastic a 0 0 5 1 1 2 0 0",
            "a reflectance R",
        ),
        (
            Format::Radiance,
            "void plastic a 0 0 5 1 1 x 0 0",
            "not a number",
        ),
        (
            Format::Radiance,
            "void plastic a 0 18446744073709551616 0",
            "no count",
        ),
    ] {
        match read(format, text) {
            Err(error @ Error::Contents { .. }) => {
                assert!(error.to_string().contains(part), "{text}: {error}");
            }
            other => panic!("{text}: {other:?}"),
        }
    }
    let twice = vec![Material::white(), Material::white()];
    assert!(write(Format::Radiance, &twice).is_err());
}
