// The API's documentation: Swagger UI over this service's own description of itself.

window.SwaggerUIBundle({
  url: "openapi.json",
  dom_id: "#operations",
  deepLinking: true,
  defaultModelsExpandDepth: 0,
  // Nothing is sent elsewhere, and a key is forgotten with the page.
  validatorUrl: null,
  persistAuthorization: false,
});
